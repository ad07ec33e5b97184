// Lit, textured bodies. One formula for all surfaces; a table says how each behaves.
uniform sampler2DArray u_textures;
uniform vec4 u_material[20];  // share of the body's colour, least reflection, reflection by the texture's alpha, glow
uniform float u_lit;
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
    float sun = max(dot(normal, u_sun), 0.0);
    float up = 0.5 + 0.5 * normal.z;
    float shade = clamp(0.45 + 0.7 * v_height, 0.45, 1.0);  // less sky near the ground
    vec3 bounce = 0.14 * (u_sun_colour * max(u_sun.z, 0.0) + u_horizon);
    vec3 light = u_sun_colour * sun + shade * mix(bounce, 0.75 * (u_zenith + u_horizon), up * up);
    vec3 mirror = reflect(view, normal);
    vec3 world = mix(0.10 * (u_sun_colour + u_horizon), sky(mirror.z), smoothstep(-0.06, 0.05, mirror.z));
    float grazing = 1.0 - facing;
    grazing *= grazing;
    float gloss = material.y + material.z * texel.a;
    float reflection = clamp(gloss * (1.0 + 8.0 * grazing * grazing * grazing), 0.0, 0.9);
    float glint = pow(max(dot(mirror, u_sun), 0.0), 90.0) * min(8.0 * gloss, 1.0);
    vec3 colour = mix(albedo * light, world, reflection) + glint * u_sun_colour;
    o_colour = vec4(film(hazed(colour, distance)), 1.0);
    o_id = v_id;
    o_depth = v_depth;
}
