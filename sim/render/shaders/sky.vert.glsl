// A grid over the frame at the far end of the depth range; each corner knows where in the panorama it looks.
in vec2 in_corner;
uniform mat3 u_look;  // columns: world direction per unit of screen x, of screen y, and straight ahead
uniform float u_middle;  // azimuth straight ahead
uniform float u_highest;
noperspective out vec2 v_place;

void main() {
    vec3 ray = u_look * vec3(in_corner, 1.0);
    float level = length(ray.xy);
    float turned = atan(ray.y, ray.x) - u_middle;
    turned -= 6.2831853 * floor(turned / 6.2831853 + 0.5);
    v_place = vec2((u_middle + turned) / 6.2831853, atan(ray.z, level) / u_highest);
    gl_Position = vec4(in_corner, 1.0, 1.0);
}
