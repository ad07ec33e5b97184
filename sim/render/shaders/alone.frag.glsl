// Marks the pixel in the plot of the body that covers it.
layout(std430, binding = 0) restrict writeonly buffer Plots { uint covered[]; };
flat in ivec4 v_box;  // x0, y0, x1, y1 px: the plot
flat in int v_first;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - v_box.xy, size = v_box.zw - v_box.xy;
    if (all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size)))
        covered[v_first + at.y * size.x + at.x] = 1u;
}
