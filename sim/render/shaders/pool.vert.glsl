// The whole frame; each corner knows in which direction it looks.
in vec2 in_corner;
uniform mat3 u_look;  // columns: world direction per unit of screen x, of screen y, and straight ahead
noperspective out vec3 v_ray;

void main() {
    v_ray = u_look * vec3(in_corner, 1.0);
    gl_Position = vec4(in_corner, 0.0, 1.0);
}
