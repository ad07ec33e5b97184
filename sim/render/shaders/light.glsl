// What all colour shaders share: the sky's light, haze and the response of the film.
uniform vec3 u_sun;
uniform vec3 u_sun_colour;
uniform vec3 u_zenith;
uniform vec3 u_horizon;
uniform float u_haze;

vec3 sky(float up) {
    float t = clamp(up * 2.2, 0.0, 1.0);
    return mix(u_horizon, u_zenith, t * (2.0 - t));
}

vec3 hazed(vec3 colour, float distance) {
    return mix(u_horizon, colour, exp(-u_haze * distance));
}

// Square root in place of the sRGB curve (textures are squared in turn), with a soft shoulder.
vec3 film(vec3 light) {
    light = max(light, 0.0);
    vec3 shown = sqrt(light * (1.0 + 0.12 * light) / (1.0 + 0.42 * light * light));
    return shown * (0.85 + shown * (0.45 - 0.30 * shown));
}
