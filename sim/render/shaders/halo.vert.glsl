// A square around a lamp, as wide in the picture as its glare.
in vec2 in_corner;
in vec3 i_position;
in float i_radius;
in vec3 i_colour;
uniform mat4 u_clip;
uniform vec2 u_pixel;  // clip units a pixel
out vec2 v_corner;
flat out vec3 v_colour;

void main() {
    // A little nearer than the lamp's own glass, so that it does not hide its glare.
    vec4 middle = u_clip * vec4(i_position * (1.0 - min(0.6 / length(i_position), 0.2)), 1.0);
    gl_Position = middle + vec4(in_corner * i_radius * u_pixel * middle.w, 0.0, 0.0);
    v_corner = in_corner;
    v_colour = i_colour;
}
