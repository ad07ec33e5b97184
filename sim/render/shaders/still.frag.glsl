// The ground as it was painted before.
uniform sampler2D u_shadow;
uniform usampler2D u_kept;  // colour in the sun, colour in the shade, metres along the axis, depth
layout(location = 0) out vec4 o_colour;
layout(location = 1) out uint o_id;
layout(location = 2) out float o_depth;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uvec4 kept = texelFetch(u_kept, at, 0);
    o_colour = unpackUnorm4x8(texelFetch(u_shadow, at, 0).r > 0.5 ? kept.y : kept.x);
    o_id = 1u;
    o_depth = uintBitsToFloat(kept.z);
    gl_FragDepth = uintBitsToFloat(kept.w);
}
