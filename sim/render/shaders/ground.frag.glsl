// The ground, painted from the position along and across the road.
#define LINES 24
uniform sampler2D u_grain;
uniform sampler2D u_road;
uniform sampler2DArray u_textures;
uniform sampler2D u_shadow;
uniform vec2 u_paved;
uniform float u_margin;
uniform float u_wet;
uniform int u_lines;
uniform vec3 u_line[LINES];  // offset, half width (negative: dashed), yellow
in vec3 v_at;
in vec2 v_road;
uniform vec3 u_forward;
layout(location = 0) out vec4 o_colour;
layout(location = 1) out uint o_id;
layout(location = 2) out float o_depth;

void main() {
    float s = v_road.x, d = v_road.y;
    float distance = length(v_at);
    float wide = fwidth(d), along = fwidth(s);
    vec4 worn = texture(u_road, vec2((d - u_paved.x + u_margin) / (u_paved.y - u_paved.x + 2.0 * u_margin), s / 240.0), -1.5);
    vec4 fine = texture(u_grain, vec2(d / 2.0, s / 8.0), -1.0);
    vec4 broad = texture(u_grain, vec2(d / 60.0, s / 60.0));

    float painted = 0.0, yellow = 0.0;
    for (int i = 0; i < u_lines; i++) {
        vec3 line = u_line[i];
        float half_width = abs(line.y);
        float cover = clamp((half_width - abs(d - line.x)) / wide + 0.5, 0.0, 1.0) * min(2.0 * half_width / wide, 1.0);
        float phase = mod(s, 12.0) - 1.5;
        float reach = max(along, 0.02);
        float dash = clamp((1.5 - abs(phase - 12.0 * floor(phase / 12.0 + 0.5))) / reach + 0.5, 0.0, 1.0);
        dash = mix(dash, 0.25, clamp(along / 8.0 - 0.3, 0.0, 1.0));
        cover *= line.y < 0.0 ? dash : 1.0;
        painted = max(painted, cover);
        yellow = max(yellow, cover * line.z);
    }
    float asphalt = 0.165 * worn.r * (0.55 + 0.9 * fine.r) * (0.9 + 0.2 * fine.g);
    asphalt *= 1.0 - 0.45 * worn.g - 0.35 * fine.b * smoothstep(0.45, 0.7, broad.a);
    vec3 tarmac = asphalt * vec3(0.98, 1.0, 1.05);
    tarmac = mix(tarmac, vec3(0.20, 0.18, 0.15), 0.55 * worn.a);
    float kept = painted * clamp(1.35 - 0.9 * worn.b * worn.b - 0.5 * fine.r * worn.b, 0.0, 1.0);
    tarmac = mix(tarmac, yellow > 0.5 * painted ? vec3(0.62, 0.40, 0.08) : vec3(0.62, 0.62, 0.60), kept);

    vec3 grass = texture(u_textures, vec3(d / 5.0, s / 5.0, 17.0)).rgb;
    grass *= grass;
    vec3 dry = vec3(0.42, 0.34, 0.18) * (0.4 + 0.9 * fine.g) ;
    vec3 land = mix(grass, dry, smoothstep(0.42, 0.6, broad.a)) * (0.65 + 0.7 * broad.g);
    vec3 soil = vec3(0.26, 0.22, 0.17) * (0.5 + fine.r);
    float off = max(u_paved.x - d, d - u_paved.y) + 0.35 * (fine.g - 0.5);
    vec3 verge = mix(soil, land, smoothstep(0.3, 1.1, off + 0.8 * (broad.r - 0.5)));
    float off_road = clamp(off / max(wide, 0.03) + 0.5, 0.0, 1.0);
    vec3 albedo = mix(tarmac, verge, off_road);
    float road_mark = kept * (1.0 - off_road);

    vec2 pixel = gl_FragCoord.xy / vec2(textureSize(u_shadow, 0));
    float shadow = 1.0 - texture(u_shadow, pixel).r;
    vec3 light = u_sun_colour * (max(u_sun.z, 0.0) * shadow) + 0.5 * (u_zenith + u_horizon);
    vec3 view = v_at / distance;
#ifdef NIGHT
    float beam = own_beam(v_at, mix(vec3(0.0, 0.0, 1.0), -view, 0.05));
    light += lamplight(v_at, vec3(0.0, 0.0, 1.0)) + beam * vec3(1.0, 0.93, 0.8) * (1.0 + 3.0 * road_mark);
#endif
    vec3 colour = albedo * light;
    // A wet road is darker and mirrors at grazing angles; water gathers in the wheel tracks.
    float film_of_water = u_wet * (1.0 - off_road) * clamp(0.55 + 2.5 * (worn.r - 0.5) + 0.5 * (broad.g - 0.4), 0.25, 1.0);
    float grazing = 1.0 + min(view.z, 0.0);
    grazing *= grazing;
    float mirrored = film_of_water * (0.03 + 0.75 * grazing * grazing * grazing);
    colour = mix(colour * (1.0 - 0.45 * film_of_water), mix(u_horizon, u_zenith, 0.25), mirrored);
#ifdef NIGHT
    colour += lampmirror(v_at, view, mix(60.0, 240.0, u_wet)) * (0.004 + 0.10 * film_of_water);
#endif
    o_colour = vec4(film(hazed(colour, distance)), 1.0);
    o_id = 1u;
    o_depth = dot(u_forward, v_at);
}
