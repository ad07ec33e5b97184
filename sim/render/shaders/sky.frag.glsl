// The sky behind everything, from the panorama.
uniform sampler2D u_panorama;
uniform mat3 u_look;  // columns: world direction per unit of screen x, of screen y, and straight ahead
uniform float u_highest;
in vec2 v_screen;
out vec4 o_colour;

void main() {
    vec3 ray = normalize(u_look * vec3(v_screen, 1.0));
    float azimuth = atan(ray.y, ray.x) * 0.15915494;
    vec3 radiance = textureLod(u_panorama, vec2(azimuth, max(asin(ray.z), 0.0) / u_highest), 0.0).rgb;
    o_colour = vec4(film(radiance * radiance), 1.0);
}
