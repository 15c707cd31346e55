//! What results are stamped with: the profile of the build, `debug` or `release`.

fn main() {
    let profile = std::env::var("PROFILE").expect("cargo sets it");
    println!("cargo::rustc-env=BUILD_PROFILE={profile}");
    println!("cargo::rerun-if-changed=build.rs");
}
