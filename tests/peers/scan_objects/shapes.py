"""Six objects of the sizes of YCB's, as closed triangle meshes in metres, and what is painted on them."""

import numpy as np
import manifold3d as m3
import trimesh

GENUS = {"box": 0, "can": 0, "bottle": 0, "bowl": 0, "mug": 1, "spoon": 0}
TEXTURE = 1024


def _mesh(solid):
    raw = solid.to_mesh()
    return trimesh.Trimesh(np.asarray(raw.vert_properties)[:, :3], np.asarray(raw.tri_verts), process=True)


def _turned(profile, around=180):
    """A closed outline (radius, height) turned about z."""
    return m3.Manifold.revolve(m3.CrossSection([np.asarray(profile, float)]), around)


def _arc(centre, radius, first, last, count):
    angles = np.linspace(np.radians(first), np.radians(last), count)
    return [[centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)] for a in angles]


def box():
    """A sugar box: 38 x 89 x 176 mm with edges rounded by 2 mm."""
    r, size = 2.0, np.array([38.0, 89.0, 176.0])
    ball = m3.Manifold.sphere(r, 24)
    half = size / 2 - r
    corners = [ball.translate(np.array([x, y, z]) * half) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return m3.Manifold.batch_hull(corners)


def can():
    """A soup can: 66 mm across, 101 mm high, with a rim at both ends."""
    outline = [[0, 0], [30, 0], [30.5, -1.5], [32.5, -1.5]] + _arc((32, 0), 1.0, -45, 0, 4)
    outline += [[33, 98]] + _arc((32, 99.5), 1.0, 0, 45, 4) + [[32.5, 101], [30.5, 101], [30, 99.5], [0, 99.5]]
    return _turned(outline)


def bottle():
    """A mustard bottle: an oval body, shoulders, a neck with a cap; 190 mm high."""
    outline = [[0, 0], [36, 0]] + _arc((36, 3), 3, -90, 0, 8) + [[40, 60], [39, 115]]
    outline += _arc((22, 118), 17, 0, 70, 16) + [[16, 150], [15, 152]]
    outline += [[15, 165]] + [[11, 176], [6, 190], [0, 190]]
    return _turned(outline).scale([1.15, 0.72, 1.0])


def bowl():
    """A bowl: 159 mm across, 53 mm high, a wall of 3.5 mm and a foot."""
    outside = [[0, 0], [38, 0], [39, 5]] + _arc((0, 81), 80, -72, -20, 48)
    inside = _arc((0, 81), 76.5, -20, -90, 64)
    return _turned(outside + [[p[0], p[1]] for p in inside])


def mug():
    """A mug: 82 mm across, 81 mm high, a wall of 4 mm, and a handle of 11 mm."""
    outside = [[0, 0], [38, 0]] + _arc((37, 4), 4, -75, 0, 8) + [[41, 79]] + _arc((39, 79), 2.0, 0, 180, 12)
    body = _turned(outside + [[37, 9]] + _arc((33, 9), 4, 0, -90, 8)[1:] + [[0, 5]])
    ring = m3.Manifold.revolve(m3.CrossSection.circle(5.5, 48).translate([24, 0]), 128)
    ring = ring.rotate([90, 0, 0]).scale([1.0, 1.0, 1.1]).translate([44, 0, 41])
    hollow = m3.Manifold.cylinder(200, 38.5, 38.5, 180).translate([0, 0, 4.5])
    return body + (ring - hollow)


def spoon():
    """A spoon of 195 mm with a bowl of 3 mm wall and a handle of 5 mm."""
    shell = m3.Manifold.sphere(1, 96).scale([32, 20, 14]) - m3.Manifold.sphere(1, 96).scale([29.5, 17.5, 11.3])
    shell = shell.trim_by_plane([0, 0, -1], 2.0)
    ends = [([26, 0, -4.0], 3.2), ([60, 0, 6.0], 2.8), ([150, 0, 4.0], 4.5)]
    balls = [m3.Manifold.sphere(r, 32).scale([1, 1.6, 0.9]).translate(at) for at, r in ends]
    handle = balls[0].batch_hull(balls[:2]) + balls[0].batch_hull(balls[1:])
    return shell + (handle - m3.Manifold.sphere(1, 96).scale([29.5, 17.5, 11.3]))


def objects():
    """Name and mesh of each, centred on its bounding box, longest edge at most 1.5 mm."""
    for name, solid in [("box", box), ("can", can), ("bottle", bottle), ("bowl", bowl), ("mug", mug), ("spoon", spoon)]:
        mesh = _mesh(solid().refine_to_length(3.0))
        mesh.apply_scale(1e-3)
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
        assert mesh.is_watertight and genus(mesh) == GENUS[name], (name, mesh.is_watertight, genus(mesh))
        yield name, mesh


def genus(mesh):
    return 1 - mesh.euler_number // 2


def paint(rng, size=TEXTURE):
    """A picture as it is printed on packages: patches of colour, fine lines and letters' strokes over soft shades."""
    from scipy.ndimage import gaussian_filter

    picture = np.empty((size, size, 3))
    for channel in range(3):
        soft = sum(gaussian_filter(rng.standard_normal((size, size)), s, mode="wrap") * s for s in (12, 30, 80))
        soft = (soft - soft.min()) / np.ptp(soft)
        picture[..., channel] = 0.15 + 0.7 * soft
    rows, columns = np.mgrid[0:size, 0:size]
    for _ in range(70):
        at, extent, colour = rng.integers(0, size, 2), rng.integers(12, 90, 2), rng.uniform(0.08, 0.92, 3)
        if rng.random() < 0.5:
            patch = (abs(rows - at[0]) < extent[0]) & (abs(columns - at[1]) < extent[1])
        else:
            patch = ((rows - at[0]) / extent[0]) ** 2 + ((columns - at[1]) / extent[1]) ** 2 < 1
        picture[patch] = colour
    return (np.clip(gaussian_filter(picture, (1.2, 1.2, 0)), 0, 1) * 255).astype(np.uint8)


def unfolded(mesh):
    """Corners, normals and texture coordinates of each triangle: projected along the axis nearest to its normal, one of six
    fields of a 3 x 2 atlas, 230 mm a field."""
    corners = mesh.vertices[mesh.faces]
    axis = np.abs(mesh.face_normals).argmax(axis=1)
    side = np.take_along_axis(mesh.face_normals, axis[:, None], 1)[:, 0] > 0
    others = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    plane = np.take_along_axis(corners, others[:, None, :].repeat(3, 1), 2) / 0.23 + 0.5
    field = np.stack([axis / 3.0, side / 2.0], 1)
    texture = field[:, None, :] + plane * np.array([1 / 3.0, 0.5])
    return corners, np.asarray(mesh.vertex_normals)[mesh.faces], texture
