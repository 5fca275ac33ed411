//! Turns `proto/` into Rust types and into the descriptors that clips carry, without an installed protobuf compiler.

use std::error::Error;
use std::path::PathBuf;

const FILES: [&str; 10] = [
    "foxglove/PoseInFrame.proto",
    "foxglove/RawImage.proto",
    "foxglove/CameraCalibration.proto",
    "foxglove/JointStates.proto",
    "foxglove/Log.proto",
    "foxglove/FrameTransforms.proto",
    "twinalign/arm.proto",
    "twinalign/twin.proto",
    "twinalign/devices.proto",
    "twinalign/target.proto",
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let mut compiler = protox::Compiler::new(["proto"])?;
    compiler.include_imports(true).open_files(FILES)?;
    std::fs::write(out.join("descriptors.bin"), compiler.encode_file_descriptor_set())?;
    prost_build::Config::new().out_dir(&out).compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
