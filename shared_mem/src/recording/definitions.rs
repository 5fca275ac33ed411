//! Definitions of the ROS 2 messages that bags are written with, as `ros2 bag record` stores them: the message, then
//! everything it uses. Comments of the originals are left out; fields and their order are the wire format.

const TIME: &str = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const POINT: &str = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const POSE: &str = "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n";
const WRENCH: &str = "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n";
const TRANSFORM: &str =
    "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n";
const STAMPED: &str = "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n";
const REGION: &str = "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n";

/// Text of a ROS 2 type's definition (`sensor_msgs/msg/JointState`); empty for types that are never written.
pub fn definition(type_name: &str) -> String {
    let (own, used): (&str, &[&str]) = match type_name {
        "sensor_msgs/msg/JointState" => (
            "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
            &[HEADER, TIME],
        ),
        "geometry_msgs/msg/PoseStamped" => {
            ("std_msgs/Header header\ngeometry_msgs/Pose pose\n", &[HEADER, TIME, POSE, POINT, QUATERNION])
        }
        "geometry_msgs/msg/WrenchStamped" => {
            ("std_msgs/Header header\ngeometry_msgs/Wrench wrench\n", &[HEADER, TIME, WRENCH, VECTOR])
        }
        "std_msgs/msg/String" => ("string data\n", &[]),
        "tf2_msgs/msg/TFMessage" => {
            ("geometry_msgs/TransformStamped[] transforms\n", &[STAMPED, HEADER, TIME, TRANSFORM, VECTOR, QUATERNION])
        }
        "sensor_msgs/msg/Image" => (
            "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n",
            &[HEADER, TIME],
        ),
        "sensor_msgs/msg/CompressedImage" => ("std_msgs/Header header\nstring format\nuint8[] data\n", &[HEADER, TIME]),
        "sensor_msgs/msg/CameraInfo" => (
            "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
            &[HEADER, TIME, REGION],
        ),
        "rcl_interfaces/msg/Log" => (
            "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\nbuiltin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n",
            &[TIME],
        ),
        _ => return String::new(),
    };
    let rule = "=".repeat(80);
    used.iter().fold(own.to_owned(), |text, part| format!("{text}{rule}\n{part}"))
}
