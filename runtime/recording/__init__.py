"""Recordings of runs as Rerun files.

`recorder.RunRecorder` writes, `reader.read_recording` and `reader.resume_state` read, `verify.verify` checks,
`play.play` shows. Import the one that is needed: Rerun takes a second to load.
"""
