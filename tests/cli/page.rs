//! `stickslip plot --html` from the user's side: the page, the messages, and files that are not replaced.

use crate::common::cli::Folder;
use crate::common::unlocked;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.ok_short("-q");
    folder
}

#[test]
fn cli_page_is_named_on_standard_output() {
    let folder = folder();
    let (stdout, stderr) = folder.ends("plot paper.h5 --html report.html", 0);
    assert_eq!((stdout.as_str(), stderr.as_str()), ("report.html\n", ""));
    assert_eq!(folder.names(), ["paper.h5", "report.html"]);
    let stdout = folder.ok("plot paper.h5 --html report.html -q");
    assert_eq!(stdout, "");
    let document = folder.json("plot paper.h5 --html report.html");
    assert_eq!(document["file"], "report.html");
    assert_eq!(document["page"]["samples"], document["page"]["samples_kept"]);
    let bytes = std::fs::metadata(folder.path("report.html")).unwrap().len();
    assert_eq!(document["page"]["bytes"], bytes);
}

#[test]
fn cli_pages_are_reproducible() {
    let folder = folder();
    for name in ["a.html", "b.html"] {
        folder.ok(&["plot", "paper.h5", "--html", name]);
    }
    assert_eq!(folder.read("a.html"), folder.read("b.html"));
}

#[test]
fn cli_only_an_own_page_is_replaced() {
    let folder = folder();
    let foreign = folder.write("mine.html", "<!DOCTYPE html><title>mine</title>");
    folder.refused(
        "plot paper.h5 --html mine.html",
        "mine.html: there already, and not a page that this program made & --force",
    );
    let found = std::fs::read_to_string(&foreign).unwrap();
    assert_eq!(found, "<!DOCTYPE html><title>mine</title>");
    folder.ok("plot paper.h5 --html mine.html --force");
    assert!(
        std::fs::read_to_string(&foreign)
            .unwrap()
            .contains("content=\"stickslip")
    );
    // From now on the page is the program's own.
    folder.ok("plot paper.h5 --html mine.html");
    // A result is no page, even if the program has written it.
    std::fs::copy(folder.path("paper.h5"), folder.path("other.h5")).unwrap();
    folder.refused("plot paper.h5 --html other.h5", "");
    assert_eq!(folder.names(), ["mine.html", "other.h5", "paper.h5"]);
}

#[test]
fn cli_the_input_is_never_replaced() {
    let folder = folder();
    let before = folder.read("paper.h5");
    std::fs::hard_link(folder.path("paper.h5"), folder.path("link.html")).unwrap();
    for target in ["paper.h5", "./paper.h5", "link.html"] {
        folder.refused(
            &["plot", "paper.h5", "--html", target, "--force"],
            "this is the file to be drawn",
        );
    }
    assert_eq!(folder.read("paper.h5"), before);
}

#[test]
fn cli_a_page_that_has_no_place_says_so() {
    let folder = folder();
    for (target, words) in [
        ("missing/report.html", "the folder missing does not exist"),
        (".", "a folder; name a file in it"),
        ("reports/", "a folder; name a file in it"),
    ] {
        folder.refused(&["plot", "paper.h5", "--html", target], &[words, "--html"]);
    }
    assert_eq!(folder.names(), ["paper.h5"]);
}

#[test]
fn cli_a_page_shows_two_runs_and_not_three() {
    let folder = folder();
    std::fs::copy(folder.path("paper.h5"), folder.path("other.h5")).unwrap();
    let (stdout, stderr) = folder.ends("plot paper.h5 other.h5 --html pair.html", 0);
    assert_eq!((stdout.as_str(), stderr.as_str()), ("pair.html\n", ""));
    let page = folder.text("pair.html");
    assert!(page.contains("difference_of_relative_velocity"));
    let (_, heading) = page.split_once("<h1 id=\"title\">").unwrap();
    let (heading, _) = heading.split_once("</h1>").unwrap();
    assert!(
        heading.contains("paper.h5") && heading.contains("other.h5"),
        "{heading}"
    );
    folder.refused(
        "plot paper.h5 other.h5 paper.h5 --html three.html",
        "or two, and 3 files are given",
    );
    // Neither of the two is ever replaced.
    folder.refused("plot paper.h5 other.h5 --html other.h5 --force", &["other.h5"]);
}

#[test]
fn cli_a_page_of_something_else_is_refused() {
    let folder = folder();
    folder.write("case.toml", "title = \"no result\"");
    for (input, words) in [
        ("case.toml", "not an HDF5 file"),
        ("missing.h5", "no such file"),
        (".", "this is a folder"),
    ] {
        folder.refused(&["plot", input, "--html", "report.html"], &[words]);
    }
    // A result whose trajectory has been removed.
    let file = unlocked::open_rw(folder.path("paper.h5")).unwrap();
    file.unlink("trajectory").unwrap();
    drop(file);
    folder.refused("plot paper.h5 --html report.html", &["paper.h5: has no", "trajectory"]);
    assert!(!folder.path("report.html").exists());
}

#[cfg(unix)]
#[test]
fn cli_a_page_is_as_readable_as_any_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    folder.ok("plot paper.h5 --html report.html");
    let mode = |name: &str| std::fs::metadata(folder.path(name)).unwrap().permissions().mode() & 0o777;
    folder.write("plain", "made under the same umask");
    assert_eq!(mode("report.html"), mode("plain"));
}

/// The page is given to the program that opens files in a browser.
#[cfg(target_os = "linux")]
#[test]
fn cli_page_opens_in_the_browser() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    folder.ok_short("-q");
    std::fs::create_dir(folder.path("bin")).unwrap();
    let browser = folder.write("bin/xdg-open", "#!/bin/sh\nprintf '%s' \"$1\" > opened.txt\n");
    std::fs::set_permissions(&browser, std::fs::Permissions::from_mode(0o755)).unwrap();
    let opens = |path: &str, status: i32| {
        let mut command = folder.stickslip("plot paper.h5 --html page.html --open");
        crate::common::cli::output(command.env("PATH", path), status)
    };
    let path = format!("{}:/usr/bin:/bin", folder.path("bin").display());
    opens(&path, 0);
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(20);
    let opened = || std::fs::read_to_string(folder.path("opened.txt")).unwrap_or_default();
    while opened() != "page.html" {
        assert!(std::time::Instant::now() < deadline, "{:?}", opened());
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    // Without such a program the page is there nevertheless.
    let (stdout, stderr) = opens("/nonexistent", 1);
    assert_eq!(stdout, "page.html\n");
    assert!(
        stderr.contains("page.html: written, but no browser could be started"),
        "{stderr}"
    );
    folder.refused("plot paper.h5 --open", "--html");
}
