// Lamps at night: the beam of the camera's own car and the nearest others.
#define LIGHTS 12
uniform int u_lamps;
uniform vec3 u_lamp_at[LIGHTS];
uniform vec3 u_lamp_colour[LIGHTS];
uniform vec4 u_lamp_aim[LIGHTS];
uniform vec3 u_ahead;
uniform vec3 u_right;
uniform float u_beam;

// Light of the own low beam that falls on a surface: cut off just below level, a little higher on the near side.
// Below, it falls off steeply: the road is dark before the bonnet and brightest some twenty metres ahead.
float own_beam(vec3 at, vec3 normal) {
    vec3 from = vec3(dot(at, u_right), at.z + 0.55, dot(at, u_ahead) - 1.0);
    float reach = max(length(from), 1.0);
    float aside = from.x / max(from.z, 0.1), up = from.y / max(from.z, 0.1);
    float cut = -0.012 + 0.03 * clamp(aside * 4.0, 0.0, 1.0);
    float below = 1.0 - smoothstep(cut - 0.012, cut + 0.012, up);
    float spread = exp(min(up - cut, 0.0) * 34.0 - aside * aside * 7.0);
    float lobe = spread * mix(0.03, 1.0, below) * step(0.0, from.z);
    float facing = max(-dot(normal, at) / length(at), 0.0);
    return u_beam * lobe * facing / (reach * reach);
}

// Nothing beyond `within` metres of the camera.
vec3 lamplight(vec3 at, vec3 normal, float within) {
    vec3 sum = vec3(0.0);
    int count = dot(at, at) < within * within ? u_lamps : 0;
    for (int i = 0; i < count; i++) {
        vec3 away = at - u_lamp_at[i];
        float square = dot(away, away) + 0.3;
        vec3 ray = away * inversesqrt(square);
        float lobe = pow(max(dot(ray, u_lamp_aim[i].xyz), 0.001), u_lamp_aim[i].w);
        // Headlamps, whose beams are narrow, are dipped.
        lobe *= u_lamp_aim[i].w > 10.0 ? mix(1.0, 0.03, smoothstep(-0.024, 0.0, ray.z)) : 1.0;
        sum += u_lamp_colour[i] * (lobe * max(-dot(ray, normal), 0.0) / square);
    }
    return sum;
}

// Lamps mirrored in a rough, wet ground: `sharp` is the power of the mirror's cosine.
vec3 lampmirror(vec3 at, vec3 view, float sharp) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < u_lamps; i++) {
        vec3 toward = normalize(u_lamp_at[i] - at);
        vec3 half_way = normalize(toward - view);
        float lobe = pow(max(dot(-toward, u_lamp_aim[i].xyz), 0.001), min(u_lamp_aim[i].w, 4.0));
        sum += min(u_lamp_colour[i], vec3(12.0)) * (lobe * pow(half_way.z, sharp));
    }
    return sum;
}
