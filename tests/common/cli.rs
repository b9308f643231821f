//! The program as a user starts it: in a folder of its own, by its arguments.

use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::Command;
use stickslip::results::{ResultFile, StudyFile, schema};

/// A run that is over in a moment: the ramp and the beginning of the sliding.
pub const SHORT: &[&str] = &["--set", "output.end_time=0.05", "--set", "output.interval=1e-3"];

/// A run of minutes that makes its way in small, even steps.
pub const LONG: &[&str] = &[
    "--set",
    "output.end_time=2",
    "--set",
    "output.interval=1e-4",
    "--set",
    "solver.max_step=1e-7",
];

/// A folder in which the program is started, removed at the end.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), contents).unwrap();
        self.path(name)
    }

    /// The names in the folder, in alphabetical order.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.0.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// The program with these arguments, ended after five minutes if it hangs: on a busy machine the longest take one.
    pub fn stickslip(&self, arguments: impl Arguments) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stickslip"));
        command
            .current_dir(self.0.path())
            .args(arguments.list())
            .timeout(Duration::from_secs(300));
        command
    }

    /// `stickslip run` of a few milliseconds, with more arguments.
    pub fn short_run(&self, arguments: impl Arguments) -> Command {
        let mut command = self.stickslip("run");
        command.args(arguments.list()).args(SHORT);
        command
    }

    /// Standard output and standard error of the program, which ends with this status.
    #[track_caller]
    pub fn ends(&self, arguments: impl Arguments, status: i32) -> (String, String) {
        output(&mut self.stickslip(arguments), status)
    }

    /// Standard output of the program, which ends with status 0.
    #[track_caller]
    pub fn ok(&self, arguments: impl Arguments) -> String {
        output(&mut self.stickslip(arguments), 0).0
    }

    /// The same; nothing is on standard error.
    #[track_caller]
    pub fn clean(&self, arguments: impl Arguments) -> String {
        let (stdout, stderr) = self.ends(arguments, 0);
        assert_eq!(stderr, "");
        stdout
    }

    /// The same of a short run.
    #[track_caller]
    pub fn ok_short(&self, arguments: impl Arguments) -> String {
        output(&mut self.short_run(arguments), 0).0
    }

    /// The document that the program prints with `--json`.
    #[track_caller]
    pub fn json(&self, arguments: impl Arguments) -> serde_json::Value {
        json(&output(self.stickslip(arguments).arg("--json"), 0).0)
    }

    /// What the program says of these arguments, which it refuses, in all these words.
    #[track_caller]
    pub fn refused(&self, arguments: impl Arguments, words: impl Words) -> String {
        let stderr = refusal(&mut self.stickslip(arguments));
        says(&stderr, words);
        stderr
    }

    /// The same of a short run.
    #[track_caller]
    pub fn refused_short(&self, arguments: impl Arguments, words: impl Words) -> String {
        let stderr = refusal(&mut self.short_run(arguments));
        says(&stderr, words);
        stderr
    }

    /// The same of each line of a table, `arguments | words`.
    #[track_caller]
    pub fn refuses(&self, table: &str) {
        for [arguments, words] in super::rows(table) {
            self.refused(arguments, words);
        }
    }

    /// The program as a child process whose output is kept.
    pub fn start(&self, arguments: impl Arguments) -> Child {
        std::process::Command::new(env!("CARGO_BIN_EXE_stickslip"))
            .current_dir(self.0.path())
            .args(arguments.list())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Waits until a file that the program makes has more than so many bytes.
    #[track_caller]
    pub fn wait_for(&self, child: &mut Child, name: &str, bytes: u64) {
        let deadline = Instant::now() + Duration::from_secs(30);
        while !std::fs::metadata(self.path(name)).is_ok_and(|file| file.len() >= bytes) {
            assert!(Instant::now() < deadline, "no {name}: {:?}", self.names());
            assert!(child.try_wait().unwrap().is_none(), "it ended before it had {name}");
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    /// The bytes of a file.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Makes a named pipe with a command that every Unix has.
    #[cfg(unix)]
    pub fn pipe(&self, name: &str) {
        let made = std::process::Command::new("mkfifo").arg(self.path(name)).status();
        assert!(made.unwrap().success());
    }

    /// The text of a file.
    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn sweep_file(&self, name: &str) -> StudyFile {
        StudyFile::open(&self.path(name), schema::SWEEP_FORMAT).unwrap()
    }

    pub fn result(&self, name: &str) -> ResultFile {
        ResultFile::open(&self.path(name)).unwrap()
    }
}

/// Sends a signal, such as TERM.
#[track_caller]
pub fn send(signal: &str, process: u32) {
    let kill = std::process::Command::new("kill")
        .args([format!("-{signal}"), process.to_string()])
        .status();
    assert!(kill.unwrap().success());
}

/// Arguments of the program: a text in which spaces part them and `'` quotes, as in a shell, or a list.
pub trait Arguments {
    fn list(&self) -> Vec<String>;
}

impl Arguments for &str {
    fn list(&self) -> Vec<String> {
        let mut words = Vec::new();
        for (place, part) in self.split('\'').enumerate() {
            match place % 2 {
                0 => words.extend(part.split_whitespace().map(str::to_owned)),
                _ => words.push(part.to_owned()),
            }
        }
        words
    }
}

impl Arguments for &String {
    fn list(&self) -> Vec<String> {
        self.as_str().list()
    }
}

impl<S: AsRef<str>> Arguments for &[S] {
    fn list(&self) -> Vec<String> {
        self.iter().map(|argument| argument.as_ref().to_owned()).collect()
    }
}

impl<S: AsRef<str>, const N: usize> Arguments for &[S; N] {
    fn list(&self) -> Vec<String> {
        self.as_slice().list()
    }
}

impl<S: AsRef<str>> Arguments for &Vec<S> {
    fn list(&self) -> Vec<String> {
        self.as_slice().list()
    }
}

/// Words that a text should have: a text in which `&` parts them, or a list.
pub trait Words {
    fn words(&self) -> Vec<&str>;
}

impl Words for &str {
    fn words(&self) -> Vec<&str> {
        self.split('&').map(str::trim).collect()
    }
}

impl<S: AsRef<str>> Words for &[S] {
    fn words(&self) -> Vec<&str> {
        self.iter().map(AsRef::as_ref).collect()
    }
}

impl<S: AsRef<str>, const N: usize> Words for &[S; N] {
    fn words(&self) -> Vec<&str> {
        self.iter().map(AsRef::as_ref).collect()
    }
}

/// Asserts that all the words stand in a text.
#[track_caller]
pub fn says(text: &str, words: impl Words) {
    for word in words.words() {
        assert!(text.contains(word), "{word:?} in {text}");
    }
}

/// Standard output and standard error of a command that ends with `status`.
#[track_caller]
pub fn output(command: &mut Command, status: i32) -> (String, String) {
    let output = command.output().unwrap();
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(status), "{stdout}{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert!(!stderr.contains("HDF5-DIAG"), "{stderr}");
    (stdout, stderr)
}

/// What a refused command says on standard error; nothing is on standard output.
#[track_caller]
pub fn refusal(command: &mut Command) -> String {
    let (stdout, stderr) = output(command, 2);
    assert_eq!(stdout, "");
    stderr
}

/// The one JSON document of a standard output.
pub fn json(stdout: &str) -> serde_json::Value {
    serde_json::from_str(stdout).unwrap_or_else(|error| panic!("{error} in {stdout}"))
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
