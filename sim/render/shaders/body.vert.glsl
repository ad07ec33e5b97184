// Places an instance of a model in front of the camera. Positions are relative to the camera, on the world's axes.
in vec3 in_position;
in vec3 i_position;
in vec2 i_turn;
in vec3 i_scale;
in vec2 i_lean;
in float in_surface;
uniform mat4 u_clip;
invariant gl_Position;

vec3 turned(vec3 v) {
    return vec3(i_turn.x * v.x - i_turn.y * v.y, i_turn.y * v.x + i_turn.x * v.y, v.z);
}

// Where a vertex stands. What leans is sheared; boughs in the wind do not all move alike.
#define FOLIAGE 9.0
vec3 placed(vec3 local) {
    vec2 aside = i_lean * local.z;
    if (in_surface == FOLIAGE) {
        aside *= 1.0 + 0.6 * sin(vec2(dot(local, vec3(1.1, 1.5, 0.7)), dot(local, vec3(1.4, -0.9, 1.2))));
    }
    return i_position + turned(local) + vec3(aside, 0.0);
}

#ifdef ALONE
in ivec4 i_box;
in int i_first;
flat out ivec4 v_box;
flat out int v_first;

void main() {
    gl_Position = u_clip * vec4(placed(in_position * i_scale), 1.0);
    v_box = i_box;
    v_first = i_first;
}
#endif

#ifdef SHADOW
// The shadow on flat ground: slid along the sun's ray, down to the height of the ground below the camera, or to
// that of the bridge on which a body stands.
in uint i_id;
uniform vec3 u_sun;
uniform float u_ground;
flat out vec2 v_falls;
out float v_height;

void main() {
    bool aloft = i_position.z > u_ground + 0.05;
    float floor_height = aloft ? i_position.z : u_ground;
    vec3 at = placed(in_position * i_scale);
    float height = max(at.z - floor_height, 0.0);
    at -= u_sun * (height / u_sun.z);
    gl_Position = u_clip * vec4(at, 1.0);
    v_falls = aloft ? vec2(0.0, 1.0) : vec2(1.0, 0.0);
    v_height = aloft || i_id >= FIRST_VEHICLE ? 0.0 : height;
}
#endif

#ifdef COLOUR
in vec3 in_normal;
in vec2 in_uv;
in vec4 i_colour;
in uint i_id;
uniform vec3 u_forward;
out vec3 v_at;
out vec3 v_normal;
out vec3 v_uv;
flat out vec4 v_colour;
out float v_height;
flat out uint v_id;
out float v_depth;

void main() {
    vec3 local = in_position * i_scale;
    v_at = placed(local);
    v_normal = turned(in_normal / i_scale);
    v_uv = vec3(in_uv, in_surface);
    v_colour = i_colour;
    v_height = local.z;
    v_id = i_id;
    v_depth = dot(u_forward, v_at);
    gl_Position = u_clip * vec4(v_at, 1.0);
}
#endif
