//! Linking with librealsense. It brings its own LZ4, and exports it; so does, of another version, what writes our clips.
//! Unless ours is kept out of the dynamic symbols, librealsense calls ours and cannot read its own recordings.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_REALSENSE").is_some() {
        println!("cargo:rustc-link-arg=-Wl,--exclude-libs,ALL");
    }
}
