"""Recordings of runs as Rerun files.

`recorder.RunRecorder` writes, `reader.read_recording` reads, `verify.verify` checks, `resume.Resumed` goes on with a
run, `compare.compare` says where two differ, `play.play` shows. Import the one that is needed: Rerun takes a second to
load.
"""
