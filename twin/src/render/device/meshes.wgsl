// Meshes in the straight picture: nearest surface, its colour as bytes, its body's number.

struct Corner {
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: u32,
}

struct Drawn {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, first) color: u32,
    @location(1) @interpolate(flat, first) instance: u32,
}

@vertex
fn corner(in: Corner, @builtin(instance_index) number: u32) -> Drawn {
    let body = bodies[number];
    let p = vec4f(in.place, 1.0);
    let seen = vec3f(dot(body.rows[0], p), dot(body.rows[1], p), dot(body.rows[2], p));
    let size = vec2f(view.straight_size);
    // Pixel centres lie at whole numbers here and at halves on the device.
    let at = view.straight.xy * seen.xy + (view.straight.zw + 0.5) * seen.z;
    var out: Drawn;
    out.position = vec4f(2.0 * at.x / size.x - seen.z, seen.z - 2.0 * at.y / size.y, NEAR, seen.z);
    let n = vec4f(in.normal, 0.0);
    let facing = dot(vec3f(dot(body.rows[0], n), dot(body.rows[1], n), dot(body.rows[2], n)), view.light.xyz);
    let light = 0.45 + 0.55 * max(facing, 0.0);
    let color = vec3u(min(vec3f((vec3u(in.color) >> vec3u(0u, 8u, 16u)) & vec3u(255u)) * light, vec3f(255.0)));
    out.color = color.x | (color.y << 8u) | (color.z << 16u);
    out.instance = body.instance;
    return out;
}

@fragment
fn surface(in: Drawn) -> @location(0) vec2u {
    return vec2u(in.color, in.instance);
}
