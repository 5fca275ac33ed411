// What all passes know: the view, the bodies, and the splats as they were uploaded. Lengths are metres and pixels.

struct View {
    focal: vec2f,
    centre: vec2f,
    // k1, k2, p1, p2; of a fisheye k1, k2, k3, k4
    bend: vec4f,
    // k3, k4, k5, k6
    more: vec4f,
    // Ends of the held slope: left, right, top, bottom in the plane z = 1.
    held: vec4f,
    background: vec4f,
    // Towards the light, camera frame.
    light: vec4f,
    // The straight picture: focal lengths and principal point.
    straight: vec4f,
    size: vec2u,
    tiles: vec2u,
    straight_size: vec2u,
    splats: u32,
    // Room for splats in tiles.
    room: u32,
    // Bit 0: there are meshes; bit 1: the lens bends; bit 2: it is a fisheye.
    flags: u32,
    row_of_groups: u32,
    spare: vec2u,
}

struct Body {
    // Rows of the camera's frame from the body's, translation last.
    rows: array<vec4f, 3>,
    // The camera in the body's frame; w is 1 where the body is shown.
    eye: vec4f,
    instance: u32,
    // Degree of its harmonics, number of its first splat, and where their coefficients begin [word].
    degree: u32,
    first: u32,
    harmonics: u32,
}

struct Splat {
    centre: vec3f,
    opacity: f32,
    // x, y, z, w
    turn: vec4f,
    sigma: vec3f,
    body: u32,
    // Coefficient of the constant function.
    color: vec3f,
    spare: u32,
}

const NEAR = 0.05;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> bodies: array<Body>;
