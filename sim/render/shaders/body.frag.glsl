// Lit, textured bodies. One formula for all surfaces; a table says how each behaves.
uniform sampler2DArray u_textures;
uniform vec4 u_material[22];  // share of the body's colour, least reflection, more of it by the alpha, retro-reflection
uniform float u_street;
uniform sampler2D u_shadow;
uniform mat4 u_slide;  // to clip space from where the ray from the sun goes on to the ground
uniform float u_ground;  // height of the ground above the camera
in vec3 v_at;
in vec3 v_normal;
in vec3 v_uv;
flat in vec4 v_colour;
in float v_height;
flat in uint v_id;
in float v_depth;
layout(location = 0) out vec4 o_colour;
layout(location = 1) out uint o_id;
layout(location = 2) out float o_depth;

#define TAIL_LAMP 6
#define HEAD_LAMP 7
#define FACADE 13
#define STREET_LAMP 16

// What a face sends out by itself.
vec3 glow(int surface, vec3 plain, float alpha) {
    int lamps = int(v_colour.a * 255.0 + 0.5);
    float tail = (lamps & 2) != 0 ? 2.2 : ((lamps & 1) != 0 && v_uv.x < 2.0 ? 0.7 : 0.0);
    vec3 sum = surface == TAIL_LAMP ? tail * vec3(1.0, 0.025, 0.02) : vec3(0.0);
    sum += surface == HEAD_LAMP && (lamps & 4) != 0 ? vec3(3.0, 2.9, 2.6) : vec3(0.0);
#ifdef NIGHT
    sum += surface == STREET_LAMP ? u_street * vec3(3.0, 2.4, 1.5) : vec3(0.0);
    vec2 pane = floor(v_uv.xy * 4.0);
    float dice = fract(sin(dot(pane, vec2(12.99, 78.23)) + float(v_id % 977u)) * 43758.5);
    float lit = step(0.80, dice) * (0.25 + 2.0 * (dice - 0.8)) * alpha;
    sum += surface == FACADE ? lit * vec3(0.75, 0.52, 0.26) : vec3(0.0);
#endif
    return sum;
}

// The share of the sun's light that arrives. On a bridge lie the shadows of what drives there; a vehicle is in
// the shade of scenery that stands higher on the ray to the sun.
float sunshine(vec3 normal) {
    if (v_id < FIRST_VEHICLE)
        return normal.z > 0.9 ? 1.0 - texelFetch(u_shadow, ivec2(gl_FragCoord.xy), 0).g : 1.0;
    vec4 meets = u_slide * vec4(v_at, 1.0);
    float highest = TALLEST * textureLod(u_shadow, 0.5 + 0.5 * meets.xy / meets.w, 0.0).b;
    // The mask keeps heights to an eighth of a metre, and a bridge does not shade what stands on it.
    return meets.w > 0.0 && highest > v_at.z - u_ground + 0.25 ? 0.0 : 1.0;
}

void main() {
    int surface = int(v_uv.z + 0.5);
    vec4 material = u_material[surface];
    vec4 texel = texture(u_textures, vec3(v_uv.xy, surface));
    vec3 paint = v_colour.rgb * v_colour.rgb;
    vec3 plain = texel.rgb * texel.rgb;
    vec3 albedo = mix(plain, material.x > 1.5 ? mix(paint, plain, texel.a) : plain * paint, min(material.x, 1.0));
    float distance = length(v_at);
    vec3 view = v_at / distance;
    vec3 normal = normalize(v_normal);
    float facing = max(-dot(view, normal), 0.0);
    float up = 0.5 + 0.5 * normal.z;
    float shade = clamp(0.45 + 0.7 * v_height, 0.45, 1.0);  // less sky near the ground
    vec3 ambient = mix(0.18 * (u_sun_colour * max(u_sun.z, 0.0) + u_horizon), 0.35 * u_zenith + 0.65 * u_horizon, up);
    float sunlit = sunshine(normal);
    vec3 light = sunlit * u_sun_colour * max(dot(normal, u_sun), 0.0) + shade * ambient;
    vec3 mirror = reflect(view, normal);
    vec3 world = mix(0.12 * (u_sun_colour + u_horizon), sky(mirror.z), clamp(mirror.z * 11.0 + 0.55, 0.0, 1.0));
    float grazing = 1.0 - facing;
    grazing *= grazing;
    float gloss = material.y + material.z * texel.a;
    float reflection = clamp(gloss * (1.0 + 8.0 * grazing * grazing * grazing), 0.0, 0.9);
    float glint = max(dot(mirror, u_sun), 0.0);
    glint *= glint;
    glint *= glint;
    glint *= glint;
    glint *= glint;
    glint *= glint;
    glint *= glint * min(8.0 * gloss, 1.0);
#ifdef NIGHT
    float beam = own_beam(v_at, normal);
    light += lamplight(v_at, normal, 60.0) + beam * vec3(1.0, 0.86, 0.68) * (1.0 + material.w);
#endif
    vec3 colour = mix(albedo * light, world, reflection) + sunlit * glint * u_sun_colour + glow(surface, plain, texel.a);
    o_colour = vec4(film(hazed(colour, distance)), 1.0);
    o_id = v_id;
    o_depth = v_depth;
}
