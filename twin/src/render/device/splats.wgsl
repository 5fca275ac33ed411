// Splats: each is projected and counted in the tiles it reaches; tiles get their share of a list, which is filled and
// sorted by depth; then every pixel blends its tile's list front to back, down to the mesh that ends the light.

struct Seen {
    centre: vec2f,
    reach: vec2f,
    // Inverse covariance xx, xy, yy; opacity, 0 where it is not seen.
    conic: vec4f,
    color: vec3f,
    depth: f32,
}

@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> harmonics: array<u32>;
@group(0) @binding(4) var<storage, read_write> seen: array<Seen>;
// For every tile how many, then for every tile where its list ends; at last the length of all.
@group(0) @binding(5) var<storage, read_write> tiles: array<atomic<u32>>;
// Depth's bits and the splat.
@group(0) @binding(6) var<storage, read_write> lists: array<vec2u>;
@group(0) @binding(7) var<storage, read_write> picture: array<u32>;
@group(0) @binding(8) var<storage, read> lookup: array<u32>;
@group(0) @binding(9) var solid_depth: texture_depth_2d;
@group(0) @binding(10) var solid: texture_2d<u32>;

const TILE = 8u;
const LOW_PASS = 0.3;
const FAINTEST = 1.0 / 255.0;
const MOST = 0.99;
const SPENT = 1e-4;

struct Bent { at: vec2f, xx: f32, xy: f32, yy: f32 }

// A power series of four terms over s, and its slope.
fn series(k: vec4f, s: f32) -> vec2f {
    return vec2f(k.x + s * (k.y + s * (k.z + s * k.w)), k.y + s * (2.0 * k.z + 3.0 * s * k.w));
}

// The factor of a polynomial lens over the square of the distance from the axis, and its slope.
fn polynomial(s: f32) -> vec2f {
    let above = series(vec4f(1.0, view.bend.xy, view.more.x), s);
    let below = series(vec4f(1.0, view.more.yzw), s);
    let factor = above.x / below.x;
    return vec2f(factor, (above.y - factor * below.y) / below.x);
}

// The same of a fisheye: the angle over the distance, times a series over the angle's square.
fn fisheye(s: f32) -> vec2f {
    var near: vec2f;
    if s < 0.05 {
        // The quotients lose digits beside the axis.
        near = series(vec4f(1.0, -1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0), s) + s * s * s * vec2f(s / 9.0, 4.0 / 9.0);
    } else {
        near.x = atan(sqrt(s)) / sqrt(s);
        near.y = (1.0 / (1.0 + s) - near.x) / (2.0 * s);
    }
    let t = s * near.x * near.x;
    let t_rise = near.x * near.x + 2.0 * s * near.x * near.y;
    let high = series(view.bend, t);
    let sum = vec2f(1.0 + t * high.x, (high.x + t * high.y) * t_rise);
    return vec2f(near.x * sum.x, near.y * sum.x + near.x * sum.y);
}

// The distortion of a point of the plane z = 1, and its slope, which is symmetric.
fn bend(p: vec2f) -> Bent {
    let r2 = dot(p, p);
    let is_fisheye = (view.flags & 4u) == 4u;
    var factor: vec2f;
    var k = view.bend.zw;
    if is_fisheye {
        factor = fisheye(r2);
        k = vec2f(0.0);
    } else {
        factor = polynomial(r2);
    }
    var out: Bent;
    out.at = p * factor.x + vec2f(
        2.0 * k.x * p.x * p.y + k.y * (r2 + 2.0 * p.x * p.x),
        k.x * (r2 + 2.0 * p.y * p.y) + 2.0 * k.y * p.x * p.y,
    );
    out.xx = factor.x + 2.0 * p.x * p.x * factor.y + 2.0 * k.x * p.y + 6.0 * k.y * p.x;
    out.xy = 2.0 * p.x * p.y * factor.y + 2.0 * k.x * p.x + 2.0 * k.y * p.y;
    out.yy = factor.x + 2.0 * p.y * p.y * factor.y + 6.0 * k.x * p.y + 2.0 * k.y * p.x;
    return out;
}

fn columns(q: vec4f) -> mat3x3f {
    let d = q.xyz + q.xyz;
    let s = q.xyz * d;
    let m = q.xxy * d.yzz;
    let w = q.w * d;
    return mat3x3f(
        vec3f(1.0 - s.y - s.z, m.x + w.z, m.y - w.y),
        vec3f(m.x - w.z, 1.0 - s.x - s.z, m.z + w.x),
        vec3f(m.y + w.y, m.z - w.x, 1.0 - s.x - s.y),
    );
}

// Coefficient `k` (from 1) of the harmonics that begin at a word: three halves each.
fn coefficient(begin: u32, k: u32) -> vec3f {
    let at = 3u * (k - 1u);
    let first = unpack2x16float(harmonics[begin + at / 2u]);
    let second = unpack2x16float(harmonics[begin + at / 2u + 1u]);
    return select(vec3f(first, second.x), vec3f(first.y, second), at % 2u == 1u);
}

fn color_towards(body: Body, number: u32, first: vec3f, way: vec3f) -> vec3f {
    var color = vec3f(0.5) + 0.28209479177387814 * first;
    if body.degree == 0u {
        return max(color, vec3f(0.0));
    }
    let count = (body.degree + 1u) * (body.degree + 1u) - 1u;
    let begin = body.harmonics + (number - body.first) * ((3u * count + 1u) / 2u);
    let x = way.x;
    let y = way.y;
    let z = way.z;
    let c1 = 0.4886025119029199;
    color += -c1 * y * coefficient(begin, 1u) + c1 * z * coefficient(begin, 2u) - c1 * x * coefficient(begin, 3u);
    if body.degree >= 2u {
        let a = 1.0925484305920792;
        color += a * x * y * coefficient(begin, 4u) - a * y * z * coefficient(begin, 5u)
            + 0.31539156525252005 * (2.0 * z * z - x * x - y * y) * coefficient(begin, 6u)
            - a * x * z * coefficient(begin, 7u) + 0.5462742152960396 * (x * x - y * y) * coefficient(begin, 8u);
    }
    if body.degree >= 3u {
        let xx = x * x;
        let yy = y * y;
        let zz = z * z;
        color += -0.5900435899266435 * y * (3.0 * xx - yy) * coefficient(begin, 9u)
            + 2.890611442640554 * x * y * z * coefficient(begin, 10u)
            - 0.4570457994644658 * y * (4.0 * zz - xx - yy) * coefficient(begin, 11u)
            + 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * coefficient(begin, 12u)
            - 0.4570457994644658 * x * (4.0 * zz - xx - yy) * coefficient(begin, 13u)
            + 1.445305721320277 * z * (xx - yy) * coefficient(begin, 14u)
            - 0.5900435899266435 * x * (xx - 3.0 * yy) * coefficient(begin, 15u);
    }
    return max(color, vec3f(0.0));
}

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn number_of(group: vec3u, local: u32) -> u32 {
    return (group.y * view.row_of_groups + group.x) * 256u + local;
}

// First and last tile of a splat: column, row, column, row.
fn reached(splat: Seen) -> vec4u {
    let most = vec2f(view.tiles - 1u);
    let low = clamp(floor((splat.centre - splat.reach) / f32(TILE)), vec2f(0.0), most);
    let high = clamp(floor((splat.centre + splat.reach) / f32(TILE)), vec2f(0.0), most);
    return vec4u(vec2u(low), vec2u(high));
}

fn projected(number: u32) -> Seen {
    var out: Seen;
    let splat = splats[number];
    let body = bodies[splat.body];
    let at = vec4f(splat.centre, 1.0);
    let centre = vec3f(dot(body.rows[0], at), dot(body.rows[1], at), dot(body.rows[2], at));
    if body.eye.w == 0.0 || centre.z < NEAR || splat.opacity < FAINTEST {
        return out;
    }
    let flat = centre.xy / centre.z;
    let pixel = view.focal * bend(flat).at + view.centre;
    let held = clamp(flat, view.held.xz, view.held.yw);
    let slope = bend(held);
    // Rows of focal * slope of the lens * slope of the division.
    let right = view.focal.x / centre.z * vec3f(slope.xx, slope.xy, -slope.xx * held.x - slope.xy * held.y);
    let down = view.focal.y / centre.z * vec3f(slope.xy, slope.yy, -slope.xy * held.x - slope.yy * held.y);
    let turn = columns(splat.turn);
    // The two rows times rotation times spread, one of the splat's axes after the other.
    let in_body = array<vec3f, 2>(
        right.x * body.rows[0].xyz + right.y * body.rows[1].xyz + right.z * body.rows[2].xyz,
        down.x * body.rows[0].xyz + down.y * body.rows[1].xyz + down.z * body.rows[2].xyz,
    );
    let u = (in_body[0] * turn) * splat.sigma;
    let v = (in_body[1] * turn) * splat.sigma;
    let xx = dot(u, u) + LOW_PASS;
    let yy = dot(v, v) + LOW_PASS;
    let xy = dot(u, v);
    // |u|²|v|² - (u v)² as the cross product's length, which single precision does not cancel.
    let area = cross(u, v);
    let determinant = dot(area, area) + LOW_PASS * (dot(u, u) + dot(v, v)) + LOW_PASS * LOW_PASS;
    let far = sqrt(max(2.0 * log(splat.opacity / FAINTEST), 0.0));
    let reach = far * sqrt(vec2f(xx, yy));
    let last = vec2f(view.size) - 1.0;
    let beside = any(pixel + reach < vec2f(0.0)) || any(pixel - reach > last);
    if beside || !is_finite(determinant) || !is_finite(reach.x + reach.y + pixel.x + pixel.y) {
        return out;
    }
    out.centre = pixel;
    out.reach = reach;
    out.conic = vec4f(yy, -xy, xx, 0.0) / determinant;
    out.conic.w = splat.opacity;
    out.depth = centre.z;
    out.color = color_towards(body, number, splat.color, normalize(splat.centre - body.eye.xyz));
    return out;
}

@compute @workgroup_size(256)
fn project(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = number_of(group, local);
    if number >= view.splats {
        return;
    }
    let splat = projected(number);
    seen[number] = splat;
    if splat.conic.w == 0.0 {
        return;
    }
    let range = reached(splat);
    for (var y = range.y; y <= range.w; y++) {
        for (var x = range.x; x <= range.z; x++) {
            atomicAdd(&tiles[y * view.tiles.x + x], 1u);
        }
    }
}

var<workgroup> sums: array<u32, 256>;

// Lists that are too long to be counted are too long to be held: the host refuses them.
fn plus(a: u32, b: u32) -> u32 {
    return select(a + b, 0xffffffffu, a + b < a);
}

// One group: from every tile's count to where its list begins.
@compute @workgroup_size(256)
fn share_out(@builtin(local_invocation_index) local: u32) {
    let count = view.tiles.x * view.tiles.y;
    let each = (count + 255u) / 256u;
    let from_tile = min(local * each, count);
    let to_tile = min(from_tile + each, count);
    var sum = 0u;
    for (var tile = from_tile; tile < to_tile; tile++) {
        sum = plus(sum, atomicLoad(&tiles[tile]));
    }
    sums[local] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var i = 0u; i < local; i++) {
        before = plus(before, sums[i]);
    }
    for (var tile = from_tile; tile < to_tile; tile++) {
        atomicStore(&tiles[count + tile], before);
        before = plus(before, atomicLoad(&tiles[tile]));
    }
    if local == 255u {
        atomicStore(&tiles[2u * count], before);
    }
}

@compute @workgroup_size(256)
fn fill(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = number_of(group, local);
    if number >= view.splats || seen[number].conic.w == 0.0 {
        return;
    }
    let count = view.tiles.x * view.tiles.y;
    let splat = seen[number];
    let range = reached(splat);
    for (var y = range.y; y <= range.w; y++) {
        for (var x = range.x; x <= range.z; x++) {
            let at = atomicAdd(&tiles[count + y * view.tiles.x + x], 1u);
            if at < view.room {
                lists[at] = vec2u(bitcast<u32>(splat.depth), number);
            }
        }
    }
}

// A tile's list: first place and the place behind its last.
fn list_of(tile: u32) -> vec2u {
    let end = atomicLoad(&tiles[view.tiles.x * view.tiles.y + tile]);
    let begin = end - atomicLoad(&tiles[tile]);
    return min(vec2u(begin, end), vec2u(view.room));
}

fn is_behind(a: vec2u, b: vec2u) -> bool {
    return a.x > b.x || (a.x == b.x && a.y > b.y);
}

const HELD = 1024u;
var<workgroup> held_list: array<vec2u, HELD>;
var<workgroup> list_range: vec2u;

// Bitonic sort of a tile's list, short ones in the group's own memory. All comparisons point the same way, so that
// what would lie beyond the end of the list stays there and is never touched.
@compute @workgroup_size(128)
fn sort(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        list_range = list_of(group.y * view.tiles.x + group.x);
    }
    let range = workgroupUniformLoad(&list_range);
    let count = range.y - range.x;
    if count < 2u {
        return;
    }
    let is_short = count <= HELD;
    if is_short {
        for (var i = local; i < count; i += 128u) {
            held_list[i] = lists[range.x + i];
        }
        workgroupBarrier();
    }
    for (var block = 2u; block < 2u * count; block *= 2u) {
        for (var gap = block / 2u; gap > 0u; gap /= 2u) {
            for (var i = local; i < count; i += 128u) {
                let other = select(i ^ gap, i ^ (block - 1u), gap == block / 2u);
                if other > i && other < count {
                    if is_short {
                        let a = held_list[i];
                        let b = held_list[other];
                        if is_behind(a, b) {
                            held_list[i] = b;
                            held_list[other] = a;
                        }
                    } else {
                        let a = lists[range.x + i];
                        let b = lists[range.x + other];
                        if is_behind(a, b) {
                            lists[range.x + i] = b;
                            lists[range.x + other] = a;
                        }
                    }
                }
            }
            if is_short {
                workgroupBarrier();
            } else {
                storageBarrier();
            }
        }
    }
    if is_short {
        for (var i = local; i < count; i += 128u) {
            lists[range.x + i] = held_list[i];
        }
    }
}

@compute @workgroup_size(TILE, TILE)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= view.size) {
        return;
    }
    let number = at.y * view.size.x + at.x;
    var surface = vec2u(0u);
    var end = bitcast<f32>(0x7f7fffffu);
    if (view.flags & 1u) == 1u {
        var straight = number;
        if (view.flags & 2u) == 2u {
            straight = lookup[number];
        }
        if straight != 0xffffffffu {
            let place = vec2u(straight % view.straight_size.x, straight / view.straight_size.x);
            let near = textureLoad(solid_depth, place, 0);
            if near > 0.0 {
                end = NEAR / near;
                surface = textureLoad(solid, place, 0).xy;
            }
        }
    }
    let range = list_of(group.y * view.tiles.x + group.x);
    let here = vec2f(at.xy);
    var left = 1.0;
    var color = vec3f(0.0);
    var depth = 0.0;
    var instance = 0u;
    for (var i = range.x; i < range.y; i++) {
        let entry = lists[i];
        let which = entry.y;
        let distance = bitcast<f32>(entry.x);
        if distance >= end || left < SPENT {
            break;
        }
        let off = here - seen[which].centre;
        let conic = seen[which].conic;
        let bell = exp(-0.5 * (conic.x * off.x * off.x + conic.z * off.y * off.y) - conic.y * off.x * off.y);
        let alpha = min(conic.w * bell, MOST);
        if alpha >= FAINTEST {
            let weight = left * alpha;
            color += weight * seen[which].color;
            depth += weight * distance;
            left -= weight;
            if instance == 0u && left < 0.5 {
                instance = bodies[splats[which].body].instance;
            }
        }
    }
    if end < bitcast<f32>(0x7f7fffffu) {
        color += left * vec3f((vec3u(surface.x) >> vec3u(0u, 8u, 16u)) & vec3u(255u)) / 255.0;
        depth += left * end;
        left = 0.0;
        if instance == 0u {
            instance = surface.y;
        }
    }
    if left < 1.0 {
        depth /= 1.0 - left;
    }
    color += left * view.background.xyz;
    let out = 6u * number;
    picture[out] = bitcast<u32>(color.x);
    picture[out + 1u] = bitcast<u32>(color.y);
    picture[out + 2u] = bitcast<u32>(color.z);
    picture[out + 3u] = bitcast<u32>(depth);
    picture[out + 4u] = instance;
    picture[out + 5u] = bitcast<u32>(1.0 - left);
}
