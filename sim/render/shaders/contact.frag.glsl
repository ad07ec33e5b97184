// How much of the sky a vehicle hides from the ground beneath and beside it: a factor on what is there.
in vec2 v_place;
flat in vec2 v_half;
out vec4 o_factor;

void main() {
    vec2 beyond = max(abs(v_place) - v_half + 0.25, 0.0);
    float open = clamp(length(beyond) / 0.8, 0.0, 1.0);
    open *= 2.0 - open;
    o_factor = vec4(vec3(mix(0.32, 1.0, open)), 1.0);
}
