//! The command under the name `leeward`.

fn main() -> std::process::ExitCode {
    leeward::main()
}
