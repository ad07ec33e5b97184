// The sky behind everything, from the panorama.
uniform sampler2D u_panorama;
uniform vec3 u_shown;  // how much lighter than painted
noperspective in vec2 v_place;
out vec4 o_colour;

void main() {
    o_colour = textureLod(u_panorama, vec2(v_place.x, max(v_place.y, 0.001)), 0.0) * vec4(u_shown, 1.0);
}
