//! Palmares: a competition server where remote controllers drive emulated compliant underactuated robot hands.

fn main() -> std::process::ExitCode {
    palmares::main(std::env::args_os())
}
