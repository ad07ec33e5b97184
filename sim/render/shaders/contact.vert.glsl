// A rectangle on the ground around a vehicle.
in vec2 in_corner;
in vec3 i_position;
in vec2 i_turn;
in vec2 i_half;
uniform mat4 u_clip;
out vec2 v_place;
flat out vec2 v_half;

void main() {
    v_half = i_half;
    v_place = in_corner * (i_half + 0.6);
    vec2 at = vec2(i_turn.x * v_place.x - i_turn.y * v_place.y, i_turn.y * v_place.x + i_turn.x * v_place.y);
    gl_Position = u_clip * vec4(i_position + vec3(at, 0.015), 1.0);
}
