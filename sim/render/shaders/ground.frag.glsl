// The ground, painted from the position along and across the road.
uniform sampler2D u_grain;
uniform sampler2D u_shadow;
uniform float u_wet;
uniform vec3 u_forward;
uniform vec2 u_paved;
#ifdef NIGHT
uniform sampler2D u_pool;  // light of lamps, and of the own beam
uniform sampler2D u_mirror;
uniform vec2 u_frame;
#endif
#if defined(PHOTO)
uniform sampler2D u_road;  // the ground from straight above
uniform vec2 u_eye;  // camera, metres east and north of the picture's corner
uniform vec2 u_extent;  // metres
#elif defined(ROAD)
uniform sampler2D u_road;
uniform sampler2D u_marks;  // by offset: middle of the nearest line, its half width, 1 if dashed, 1 if yellow
uniform float u_margin;
#else
uniform sampler2DArray u_textures;
#endif
in vec3 v_at;
in vec2 v_road;
layout(location = 0) out vec4 o_colour;
layout(location = 1) out uint o_id;
layout(location = 2) out float o_depth;

void main() {
    float distance = length(v_at);
    vec3 view = v_at / distance;
#if defined(PHOTO)
    vec2 at = v_at.xy + u_eye;
    vec3 shown = texture(u_road, at / u_extent, -0.6).rgb;
    vec4 fine = texture(u_grain, at / 19.0);
    vec3 albedo = shown * shown * (0.86 + 0.28 * fine.r);
    float road_mark = 0.0;
    float film_of_water = 0.0;
#else
    float s = v_road.x, d = v_road.y;
    vec4 broad = texture(u_grain, vec2(d, s) / 60.0);
    vec4 fine = texture(u_grain, vec2(d / 2.0, s / 8.0), -1.0);
#endif
#if defined(ROAD)
    float wide = fwidth(d), along = max(fwidth(s), 0.02);
    float across = (d - u_paved.x + u_margin) / (u_paved.y - u_paved.x + 2.0 * u_margin);
    vec4 worn = texture(u_road, vec2(across, s / 240.0), -1.5);
    vec4 line = texelFetch(u_marks, ivec2(across * float(textureSize(u_marks, 0).x), 0), 0);
    float painted = clamp((line.y - abs(d - line.x)) / wide + 0.5, 0.0, 1.0) * min(2.0 * line.y / wide, 1.0);
    float phase = s - 1.5 - 12.0 * floor((s - 1.5) / 12.0 + 0.5);
    float dash = clamp((1.5 - abs(phase)) / along + 0.5, 0.0, 1.0);
    dash = mix(dash, 0.25, clamp(along / 8.0 - 0.3, 0.0, 1.0));
    painted *= mix(1.0, dash, line.z);
    float asphalt = 0.26 * worn.r * (0.68 + 0.64 * fine.r) * (0.9 + 0.2 * fine.g);
    asphalt *= 1.0 - 0.45 * worn.g - 0.35 * fine.b * clamp((broad.a - 0.45) * 4.0, 0.0, 1.0);
    vec3 albedo = mix(asphalt * vec3(0.98, 1.0, 1.05), vec3(0.20, 0.18, 0.15), 0.55 * worn.a);
    float road_mark = painted * clamp(1.35 - 0.9 * worn.b * worn.b - 0.5 * fine.r * worn.b, 0.0, 1.0);
    albedo = mix(albedo, mix(vec3(0.62, 0.62, 0.60), vec3(0.62, 0.40, 0.08), line.w), road_mark);
    float film_of_water = u_wet * clamp(0.55 + 2.5 * (worn.r - 0.5) + 0.5 * (broad.g - 0.4), 0.25, 1.0);
#elif !defined(PHOTO)
    vec3 grass = texture(u_textures, vec3(d / 5.0, s / 5.0, 17.0)).rgb;
    vec3 dry = vec3(0.42, 0.34, 0.18) * (0.4 + 0.9 * fine.g);
    vec3 land = mix(grass * grass, dry, clamp((broad.a - 0.42) * 5.5, 0.0, 1.0)) * (0.65 + 0.7 * broad.g);
    vec3 soil = vec3(0.26, 0.22, 0.17) * (0.5 + fine.r);
    float off = max(u_paved.x - d, d - u_paved.y) + 0.8 * (broad.r - 0.5) + 0.5 * (fine.g - 0.5);
    vec3 albedo = mix(soil, land, clamp((off - 0.3) * 1.2, 0.0, 1.0));
    float road_mark = 0.0;
    float film_of_water = 0.0;
#endif
    float shadow = 1.0 - texelFetch(u_shadow, ivec2(gl_FragCoord.xy), 0).r;
    vec3 light = u_sun_colour * (max(u_sun.z, 0.0) * shadow) + 0.5 * (u_zenith + u_horizon);
#ifdef NIGHT
    vec2 place = gl_FragCoord.xy / u_frame;
    vec4 pool = textureLod(u_pool, place, 0.0);
    light += pool.rgb + pool.a * vec3(1.0, 0.86, 0.68) * (1.0 + 7.0 * road_mark);
#endif
    vec3 colour = albedo * light;
    // A wet road is darker and mirrors at grazing angles; water gathers in the wheel tracks.
    float grazing = 1.0 + min(view.z, 0.0);
    grazing *= grazing;
    float mirrored = film_of_water * (0.03 + 0.75 * grazing * grazing * grazing);
    colour = mix(colour * (1.0 - 0.45 * film_of_water), mix(u_horizon, u_zenith, 0.25), mirrored);
#ifdef NIGHT
    colour += textureLod(u_mirror, place, 0.0).rgb * (0.004 + 0.10 * film_of_water);
#endif
    o_colour = vec4(film(hazed(colour, distance)), 1.0);
    o_id = 1u;
    o_depth = dot(u_forward, v_at);
}
