// What lamps do to the flat ground: their light (and the own beam's as alpha), and their images in a wet surface.
uniform float u_ground;  // height of the ground above the camera
uniform float u_sharp;
noperspective in vec3 v_ray;
layout(location = 0) out vec4 o_light;
layout(location = 1) out vec4 o_mirror;

void main() {
    o_light = o_mirror = vec4(0.0);
    if (v_ray.z < -0.0005) {
        vec3 at = v_ray * (u_ground / v_ray.z);
        vec3 view = normalize(at), up = vec3(0.0, 0.0, 1.0);
        // Stones that stick out face the lamps better than the plane does.
        o_light = vec4(lamplight(at, up, 130.0), own_beam(at, mix(up, -view, 0.05)));
        o_mirror = vec4(lampmirror(at, view, u_sharp), 0.0);
    }
}
