// Marks what is covered: of the ground, and of bridges; and how high what covers the ground stands.
flat in vec2 v_falls;
in float v_height;  // metres above the ground, 0 where it does not count
out vec4 o_covered;

void main() {
    o_covered = vec4(v_falls, v_height / TALLEST, 0.0);
}
