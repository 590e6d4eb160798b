//! Abandoned writes leave nothing behind. In a file of its own, since nothing can be written in the process afterwards.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::sync::mpsc;

use zeroset_io::{WriteError, abandon_writes, write_report};

/// Serialises only once it is told to.
struct Slow(mpsc::Sender<()>, mpsc::Receiver<()>);

impl serde::Serialize for Slow {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.send(()).unwrap();
        self.1.recv().unwrap();
        serializer.serialize_str("late")
    }
}

#[test]
fn a_write_that_is_abandoned_leaves_the_old_file_and_no_rubbish() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join("old.json"), folder.path().join("new.json"));
    std::fs::write(&old, "old").unwrap();
    let files = || std::fs::read_dir(folder.path()).unwrap().count();

    let ((begun, wait), (go_on, go)) = (mpsc::channel(), mpsc::channel());
    let path = old.clone();
    let writer = std::thread::spawn(move || write_report(path, &Slow(begun, go)));
    wait.recv().unwrap();
    assert_eq!(files(), 2, "the old file and a temporary one");
    abandon_writes();
    assert_eq!(files(), 1);
    go_on.send(()).unwrap();
    assert!(matches!(writer.join().unwrap(), Err(WriteError::Abandoned { path }) if path == old));
    assert!(matches!(write_report(&new, &1), Err(WriteError::Abandoned { path }) if path == new));
    assert_eq!(files(), 1);
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "old");
}
