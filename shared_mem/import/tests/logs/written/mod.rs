//! Logs as other programs write them, made by code: tables, archives of arrays, bags of joint states.

use std::io::Write as _;
use std::path::Path;

/// Numbers over time [s].
pub(crate) type Signal = Box<dyn Fn(f64) -> f64>;

/// A table of columns over time.
pub(crate) fn table(columns: &[(String, Signal)], rows: u32, dt: f64) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let row = |k: u32| columns.iter().map(|(_, of)| of(f64::from(k) * dt).to_string()).collect::<Vec<_>>().join(",");
    (0..rows).fold(names.join(","), |text, k| format!("{text}\n{}", row(k))) + "\n"
}

/// An archive of arrays of two dimensions.
pub(crate) fn npz(arrays: &[(String, Vec<Vec<f64>>)]) -> Vec<u8> {
    let of = |(name, rows): &(String, Vec<Vec<f64>>)| {
        (name.clone(), vec![rows.len(), rows.first().map_or(0, Vec::len)], rows.concat())
    };
    npz_of(&arrays.iter().map(of).collect::<Vec<_>>())
}

/// An archive of arrays: name, shape and numbers row by row.
pub(crate) fn npz_of(arrays: &[(String, Vec<usize>, Vec<f64>)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, shape, values) in arrays {
        let shape = shape.iter().map(|length| format!("{length}, ")).collect::<String>();
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let plain = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        archive.start_file(format!("{name}.npy"), plain).expect("room");
        archive.write_all(b"\x93NUMPY\x01\x00").expect("room");
        archive.write_all(&(header.len() as u16).to_le_bytes()).expect("room");
        archive.write_all(header.as_bytes()).expect("room");
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        archive.write_all(&bytes).expect("room");
    }
    archive.finish().expect("room").into_inner()
}

/// A `sensor_msgs/JointState`.
pub(crate) struct JointState {
    pub(crate) names: Vec<String>,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) effort: Vec<f64>,
}

/// Messages of one stamp [ns] and joint states one behind the other.
pub(crate) type Messages = Vec<(u64, Vec<JointState>)>;

/// The definition of a message that holds so many joint states.
pub(crate) fn state_definition(fields: &[&str]) -> String {
    let rule = "=".repeat(80);
    let own: String = fields.iter().map(|field| format!("sensor_msgs/JointState {field}\n")).collect();
    format!(
        "{own}{rule}\nMSG: sensor_msgs/JointState\nstd_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
         float64[] effort\n{rule}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{rule}\n\
         MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    )
}

/// A ROS 2 bag of the storage sqlite3: topics with their types, definitions where the type is not common, and messages.
pub(crate) fn bag(path: &Path, topics: &[(&str, &str, Option<&str>, Messages)]) {
    let db = rusqlite::Connection::open(path).expect("a file");
    db.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
         CREATE TABLE message_definitions(topic_type TEXT, encoding TEXT, encoded_message_definition TEXT);
         BEGIN",
    )
    .expect("tables");
    for (id, (name, kind, definition, messages)) in topics.iter().enumerate() {
        db.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr')", (id as i64, name, kind)).expect("room");
        if let Some(text) = definition {
            db.execute("INSERT INTO message_definitions VALUES (?1, 'ros2msg', ?2)", (kind, text)).expect("room");
        }
        for (stamp_ns, states) in messages {
            let mut cdr = Cdr(Vec::new());
            states.iter().for_each(|state| cdr.joint_state(*stamp_ns, state));
            let data = [&[0, 1, 0, 0], &cdr.0[..]].concat();
            let row = (id as i64, *stamp_ns as i64, data);
            db.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", row).expect("room");
        }
    }
    db.execute_batch("COMMIT").expect("room");
}

/// A message as it is written.
struct Cdr(Vec<u8>);

impl Cdr {
    fn align(&mut self, to: usize) {
        self.0.resize(self.0.len().next_multiple_of(to), 0);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.bytes().chain([0]));
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.u32(numbers.len() as u32);
        if !numbers.is_empty() {
            self.align(8);
        }
        self.0.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    }

    fn joint_state(&mut self, stamp_ns: u64, state: &JointState) {
        self.u32((stamp_ns / 1_000_000_000) as u32);
        self.u32((stamp_ns % 1_000_000_000) as u32);
        self.text("");
        self.u32(state.names.len() as u32);
        state.names.iter().for_each(|name| self.text(name));
        [&state.position, &state.velocity, &state.effort].into_iter().for_each(|numbers| self.numbers(numbers));
    }
}
