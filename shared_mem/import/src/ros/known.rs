//! Definitions of common types, for bags that carry none (storage sqlite3 before ROS 2 Iron).

use shared_mem::recording::ros2_definition;

const TRANSFORM: &str = "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n";
const USED: [&str; 5] = [
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
    "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
];

/// The definition of a ROS 2 type; empty where it is not known.
pub(super) fn definition(type_name: &str) -> String {
    let rule = "=".repeat(80);
    let with =
        |own: &str, used: &[&str]| used.iter().fold(own.to_owned(), |text, part| format!("{text}{rule}\n{part}"));
    match type_name {
        "geometry_msgs/msg/TransformStamped" => with(TRANSFORM, &USED),
        "tf2_msgs/msg/TFMessage" => {
            let stamped = format!("MSG: geometry_msgs/TransformStamped\n{TRANSFORM}");
            with("geometry_msgs/TransformStamped[] transforms\n", &[&[stamped.as_str()], &USED[..]].concat())
        }
        _ => ros2_definition(type_name),
    }
}
