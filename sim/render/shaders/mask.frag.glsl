// Marks what is covered: of the ground, and of bridges.
flat in vec2 v_falls;
out vec2 o_covered;

void main() {
    o_covered = v_falls;
}
