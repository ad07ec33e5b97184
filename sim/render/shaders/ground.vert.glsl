// Places a stretch of ground. in_road is (arc length, offset to the left).
in vec3 in_position;
in vec2 in_road;
in vec3 i_offset;
in float i_arc;
uniform mat4 u_clip;
invariant gl_Position;

out vec3 v_at;
out vec2 v_road;

void main() {
    vec3 at = in_position + i_offset;
    gl_Position = u_clip * vec4(at, 1.0);
    v_at = at;
    v_road = vec2(in_road.x + i_arc, in_road.y);
}
