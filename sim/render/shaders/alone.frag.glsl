// Writes which body covers the pixel.
flat in uint v_id;
out uint o_id;

void main() {
    o_id = v_id;
}
