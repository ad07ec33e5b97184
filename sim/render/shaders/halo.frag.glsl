// Glare: a small core and a wide skirt, added to what is there.
in vec2 v_corner;
flat in vec3 v_colour;
out vec4 o_colour;

void main() {
    float r = dot(v_corner, v_corner);
    float edge = max(1.0 - r, 0.0);
    float core = exp(-14.0 * r);
    float skirt = 0.45 / (1.0 + 9.0 * r) * edge;
        o_colour = vec4(sqrt(max(v_colour, 0.0)) * (core + skirt) * edge, 0.0);
}
