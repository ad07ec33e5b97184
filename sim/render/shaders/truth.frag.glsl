// Identity and depth at the pixel's centre.
flat in uint v_id;
in float v_depth;
layout(location = 0) out uint o_id;
layout(location = 1) out float o_depth;

void main() {
    o_id = v_id;
    o_depth = v_depth;
}
