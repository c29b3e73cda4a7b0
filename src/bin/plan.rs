//! The command under the name `plan`.

fn main() -> std::process::ExitCode {
    leeward::main()
}
