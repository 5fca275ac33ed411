//! The well-formed files: one folder for each scenario, made from nothing, and those of logs from the fixtures of the importer. SI
//! units.

use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding};
use shared_mem::msg::object::ObjectPose;
use shared_mem::recording::{ClipInfo, ClipWriter, Format, Order, Session, export_session, write_png};
use shared_mem::topics;
use std::fmt::Write as _;
use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A pose in which the arm can start.
const READY: [f64; 7] = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];
/// Stamp of the first row, and how many there are, a period apart [ns].
const BEGIN: u64 = 5_000_000_000;
const ROWS: u64 = 1500;
const PERIOD: u64 = 2_000_000;
const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;

const CELL: &str = r#"[controller]
kind = "joint_impedance"
stiffness = [600, 600, 600, 600, 250, 150, 50]
damping = [50, 50, 50, 50, 30, 25, 15]
[tool]
mass = 0.25
length = 0.16
radius = 0.012
[table]
height = 0.0
[camera]
width = 64
height = 48
latency = 0.01
pose = { position = [1.45, 0.85, 0.85], orientation = [0.257221, -0.369651, -0.732884, 0.509977] }
"#;
const ROBOT: &str = "[robot]\nmodel = \"fr3\"\nbase_frame = \"fr3_link0\"\n";
const BOX: &str = "[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.10]\nmass_range = [0.1, 1.0]\n";
const THETA: &str = "[arm]\nstiffness = [610, 600, 590, 600, 250, 150, 50]\ndamping = [50, 50, 50, 50, 30, 25, 15]\n\
    [object]\nfriction = 0.28\nmass = 0.31\ncentre_of_mass = [0.0, 0.0, 0.01]\n[[effect]]\nname = \"command_delay\"\ndelay = 0.002\n";
const EFFECTS: &str = "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.5, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3]\n\
    [[effect]]\nname = \"command_delay\"\ndelay = 0.004\n";

/// Writes every scenario into a folder of its own below `whole`.
pub(crate) fn write(whole: &Path) {
    let folder = |name: &str| {
        let folder = whole.join(name);
        fs::create_dir_all(&folder).expect("room");
        folder
    };
    let listed = |kind: &str| format!("[[clip]]\nfile = \"clip_00.mcap\"\nkind = \"{kind}\"\n");
    let own = folder("own");
    put(&own.join("cell.toml"), format!("{ROBOT}{CELL}{BOX}{}", listed("control_hit_slide")));
    put(&own.join("theta.toml"), THETA);
    put(&own.join("effects.toml"), EFFECTS);
    stroke(&own.join("clip_00.mcap"));
    let session = Session::open(&own).expect("a session");
    let flange_at = |_: &[f64]| Some(([0.4, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]));
    let export = |to, out: &Path| {
        export_session(&session, Order { to, out, force: false, flange_at: &flange_at, robot: None }, |_| {})
            .expect("an export")
    };
    let (bag, chunked) = (folder("bag"), whole.join("chunked_bag"));
    export(Format::Ros2, &chunked);
    // Without chunks nothing vouches for a message, so that what has changed in it arrives.
    without_chunks(&chunked.join("clip_00.mcap"), &bag.join("clip_00.mcap"));
    fs::copy(chunked.join("cell.toml"), bag.join("cell.toml")).expect("room");
    export(Format::TwinAligner, &whole.join("folder"));
    let plain = folder("plain");
    without_chunks(&own.join("clip_00.mcap"), &plain.join("clip_00.mcap"));
    for file in ["cell.toml", "theta.toml"] {
        fs::copy(own.join(file), plain.join(file)).expect("room");
    }
    let robot = folder("robot");
    let by_file = "[robot]\nurdf = \"robot.urdf\"\n";
    put(&robot.join("cell.toml"), format!("{by_file}{CELL}{}", listed("excitation")));
    put(&robot.join("robot.urdf"), urdf());
    fs::copy(own.join("clip_00.mcap"), robot.join("clip_00.mcap")).expect("room");
    for (name, file, bytes) in meshes() {
        let folder = folder(name);
        let object = format!("[object]\nmesh = \"{file}\"\nmass_range = [0.1, 1.0]\n");
        put(&folder.join("cell.toml"), format!("[table]\nheight = 0.0\n{object}{}", listed("free_motion")));
        put(&folder.join(file), bytes);
        toss(&folder.join("clip_00.mcap"));
    }
    let splats = folder("splats");
    put(&splats.join("cell.toml"), format!("{ROBOT}{CELL}{}", listed("excitation")));
    fs::copy(own.join("clip_00.mcap"), splats.join("clip_00.mcap")).expect("room");
    fs::create_dir_all(splats.join("links")).expect("room");
    put(&splats.join("scan.ply"), cloud(3000));
    put(&splats.join("links/link0.ply"), cloud(100));
    pictures(&folder("pictures"));
    for log in LOGS {
        copy(&fixtures().join(log), &whole.join(log).join(log));
    }
    let plain = fs::read_to_string(fixtures().join("plain.csv")).expect("a table");
    let wide = plain.replace(',', ";").replace('.', ",");
    put(&folder("wide").join("wide.csv"), wide.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>());
    scan(&folder("scan"));
}

/// Logs of other programs, each in a scenario of its name.
pub(crate) const LOGS: [&str; 10] = [
    "rosbag2_mcap",
    "rosbag2_sqlite3",
    "franka_state.bag",
    "joint_states_bz2.bag",
    "joint_states_lz4.bag",
    "lerobot_v21",
    "lerobot_v3",
    "plain.csv",
    "log.npz",
    "sage_motion",
];

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared_mem/import/tests/fixtures")
}

/// Copies a file, or a folder with all that is in it.
pub(crate) fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("room");
        for entry in fs::read_dir(from).expect("a folder").map(|entry| entry.expect("an entry").path()) {
            copy(&entry, &to.join(entry.file_name().expect("a name")));
        }
    } else {
        fs::create_dir_all(to.parent().expect("a folder")).expect("room");
        fs::copy(from, to).expect("room");
    }
}

/// A dozen pictures of one colour around a place, with masks, which show no object.
fn scan(folder: &Path) {
    let mut frames = Vec::new();
    for i in 0..12 {
        let name = format!("{i:02}.png");
        for (kind, value) in [("images", 90_u8), ("masks", 255)] {
            fs::create_dir_all(folder.join(kind)).expect("room");
            let pixels = vec![value; 3 * (WIDTH * HEIGHT) as usize];
            write_png(&folder.join(kind).join(&name), WIDTH, HEIGHT, &pixels).expect("room");
        }
        let (s, c) = (f64::from(i) * std::f64::consts::TAU / 12.0).sin_cos();
        // From two units away along x, turned about z; x of the camera is right, its -z forwards.
        frames.push(format!(
            r#"{{"file_path": "images/{name}", "transform_matrix": [[{}, 0, {c}, {}], [{c}, 0, {s}, {}], [0, 1, 0, 0], [0, 0, 0, 1]]}}"#,
            -s,
            2.0 * c,
            2.0 * s
        ));
    }
    let camera = format!(r#""fl_x": 60, "fl_y": 60, "cx": 32, "cy": 24, "w": {WIDTH}, "h": {HEIGHT}"#);
    put(&folder.join("transforms.json"), format!("{{{camera}, \"frames\": [{}]}}", frames.join(", ")));
}

fn put(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::write(path, bytes).expect("room");
}

/// Three seconds of an arm that follows its commands, beside an object and before a camera.
fn stroke(path: &Path) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    let known = CameraInfo {
        stamp_ns: BEGIN,
        width: WIDTH,
        height: HEIGHT,
        intrinsics: [60.0, 60.0, 32.0, 24.0],
        ..CameraInfo::default()
    };
    writer.camera_info(&known).expect("room");
    for i in 0..ROWS {
        let stamp_ns = BEGIN + i * PERIOD;
        let seconds = (i * PERIOD) as f64 * 1e-9;
        let row = |late: f64, rate: bool| {
            std::array::from_fn(|j| {
                let Some(ready) = READY.get(j) else { return 0.0 };
                let (omega, t) = (3.0 + 0.4 * j as f64, seconds - late);
                if rate { 0.12 * omega * (omega * t).cos() } else { ready + 0.12 * (omega * t).sin() }
            })
        };
        let (q, dq, q_d, dq_d) = (row(0.02, false), row(0.02, true), row(0.0, false), row(0.0, true));
        let state =
            ArmState { stamp_ns, device_ns: stamp_ns, cycle: i, dof: 7, q, dq, q_d, dq_d, ..ArmState::default() };
        writer.arm_state(&state).expect("room");
        if i % 10 == 0 {
            let position = [0.55 + 1e-4 * (i as f64).sin(), 0.0, 0.05];
            writer.object_pose(&ObjectPose { stamp_ns, position, ..upright() }).expect("room");
        }
        if i % 300 == 0 {
            let header =
                ImageHeader { stamp_ns, width: WIDTH, height: HEIGHT, stride: 3 * WIDTH, ..ImageHeader::default() };
            let pixels: Vec<u8> = (0..3 * WIDTH * HEIGHT).map(|k| (k % 251) as u8).collect();
            writer.image(topics::CAMERA_COLOR, &header, &pixels).expect("room");
            let of_depth =
                ImageHeader { stride: 2 * WIDTH, encoding: PixelEncoding::Depth16, depth_scale: 1e-3, ..header };
            let pixels: Vec<u8> = (0..WIDTH * HEIGHT).flat_map(|k| (900 + (k % 700) as u16).to_le_bytes()).collect();
            writer.image(topics::CAMERA_DEPTH, &of_depth, &pixels).expect("room");
        }
    }
    writer.finish().expect("room");
}

fn upright() -> ObjectPose {
    ObjectPose { wxyz: [1.0, 0.0, 0.0, 0.0], ..ObjectPose::default() }
}

/// A body that is thrown, lands and lies still.
fn toss(path: &Path) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    for i in 0..60_u64 {
        let t = i as f64 * 0.01;
        let position = [0.4 * t.min(0.3), 0.0, (0.2 + 0.5 * t - 4.9 * t * t).max(0.05)];
        let pose = ObjectPose { stamp_ns: BEGIN + i * 10_000_000, sequence: i, position, ..upright() };
        writer.object_pose(&pose).expect("room");
    }
    writer.finish().expect("room");
}

/// The same messages one after the other, without chunks and checksums.
fn without_chunks(from: &Path, to: &Path) {
    let bytes = fs::read(from).expect("a clip");
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .use_chunks(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .create(BufWriter::new(fs::File::create(to).expect("room")))
        .expect("room");
    for message in mcap::MessageStream::new(&bytes).expect("a clip") {
        writer.write(&message.expect("a message")).expect("room");
    }
    writer.finish().expect("room");
}

/// Seven joints in a row.
fn urdf() -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n<link name=\"base\"/>\n");
    for i in 1..=7 {
        let parent = if i == 1 { "base".to_owned() } else { format!("link{}", i - 1) };
        let (roll, reach) = if i % 2 == 0 { ("-1.5708", 0.0) } else { ("1.5708", 0.3) };
        let _ = write!(
            out,
            "<link name=\"link{i}\"><inertial><origin xyz=\"0 0 0.1\"/><mass value=\"2.5\"/>\
             <inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n\
             <joint name=\"joint{i}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"link{i}\"/>\
             <origin xyz=\"0 0 {reach}\" rpy=\"{roll} 0 0\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-2.9\" upper=\"2.9\" effort=\"87\" velocity=\"2\"/></joint>\n"
        );
    }
    out + "</robot>\n"
}

/// Scenario, file and bytes of a box of 10 cm in every format.
fn meshes() -> [(&'static str, &'static str, Vec<u8>); 5] {
    let corner = |i: usize| [0, 1, 2].map(|bit| if i >> bit & 1 == 1 { 0.05_f32 } else { -0.05 });
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles: Vec<[usize; 3]> = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let (mut obj, mut text_stl) = (String::new(), String::from("solid box\n"));
    for [x, y, z] in (0..8).map(corner) {
        let _ = writeln!(obj, "v {x} {y} {z}");
    }
    let mut stl = vec![b' '; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        let _ = writeln!(obj, "f {} {} {}", triangle[0] + 1, triangle[1] + 1, triangle[2] + 1);
        text_stl += "facet normal 0 0 0\nouter loop\n";
        stl.extend([0; 12]);
        for [x, y, z] in triangle.map(corner) {
            let _ = writeln!(text_stl, "vertex {x} {y} {z}");
            stl.extend([x, y, z].map(f32::to_le_bytes).concat());
        }
        text_stl += "endloop\nendfacet\n";
        stl.extend([0; 2]);
    }
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
             element face 12\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let (mut text_ply, mut ply) = (header("ascii"), header("binary_little_endian").into_bytes());
    for [x, y, z] in (0..8).map(corner) {
        let _ = writeln!(text_ply, "{x} {y} {z}");
        ply.extend([x, y, z].map(f32::to_le_bytes).concat());
    }
    for triangle in &triangles {
        let _ = writeln!(text_ply, "3 {} {} {}", triangle[0], triangle[1], triangle[2]);
        ply.push(3);
        ply.extend(triangle.map(|i| (i as i32).to_le_bytes()).concat());
    }
    [
        ("obj", "body.obj", obj.into_bytes()),
        ("stl", "body.stl", stl),
        ("text_stl", "body.stl", (text_stl + "endsolid\n").into_bytes()),
        ("ply", "body.ply", ply),
        ("text_ply", "body.ply", text_ply.into_bytes()),
    ]
}

/// Splats along a column about where an arm stands.
fn cloud(count: u32) -> Vec<u8> {
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let columns: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let mut out =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{columns}end_header\n").into_bytes();
    for i in 0..count {
        let (turn, height) = (f64::from(i) * 2.399_963, 0.9 * f64::from(i) / f64::from(count));
        let place = [0.08 * turn.cos(), 0.08 * turn.sin(), height];
        let rest = [0.5, 0.4, 0.3, 3.0, -5.0, -5.0, -5.5, 1.0, 0.0, 0.0, 0.0];
        out.extend(place.into_iter().chain(rest).flat_map(|v| (v as f32).to_le_bytes()));
    }
    out
}

/// A picture with its mask and joints, and a photo of another size.
fn pictures(folder: &Path) {
    put(&folder.join("cell.toml"), format!("{ROBOT}{CELL}"));
    let inside = |i: u32| (20..44).contains(&(i % WIDTH)) && (8..40).contains(&(i / WIDTH));
    let paint = |on: u8, off: u8| -> Vec<u8> {
        (0..WIDTH * HEIGHT).flat_map(|i| [if inside(i) { on } else { off }; 3]).collect()
    };
    write_png(&folder.join("picture.png"), WIDTH, HEIGHT, &paint(230, 40)).expect("room");
    write_png(&folder.join("mask.png"), WIDTH, HEIGHT, &paint(255, 0)).expect("room");
    let joints = |width: u32, height: u32| {
        let k = [
            f64::from(width),
            0.0,
            f64::from(width) / 2.0,
            0.0,
            f64::from(width),
            f64::from(height) / 2.0,
            0.0,
            0.0,
            1.0,
        ];
        serde_json::json!({ "q": READY, "K": k, "D": [0.0, 0.0, 0.0, 0.0, 0.0], "width": width, "height": height })
            .to_string()
    };
    put(&folder.join("joints.json"), joints(WIDTH, HEIGHT));
    put(&folder.join("photo.json"), joints(16, 16));
    put(&folder.join("photo.jpg"), JPEG);
}

/// A grey square of 16 pixels.
const JPEG: &[u8] = include_bytes!("../../../../shared_mem/tests/data/grey_16.jpg");
