// Glare: a small core and a wide skirt, added to what is there.
in vec2 v_corner;
flat in vec3 v_colour;
out vec4 o_colour;

void main() {
    float r = dot(v_corner, v_corner);
    float edge = max(1.0 - r, 0.0);
    float core = exp(-28.0 * r);
    float skirt = 0.16 / (1.0 + 22.0 * r) * edge;
    vec3 white = vec3(max(v_colour.r, max(v_colour.g, v_colour.b)));
    o_colour = vec4(sqrt(max(mix(v_colour, white, 0.35 * core), 0.0)) * (core + skirt) * edge, 0.0);
}
