//! A rig behind a program: one JSON object a line on its standard input and output.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use super::rig_protocol::{Line, RIG_PROTOCOL, ask_look, ask_touch};
use super::{Answer, Camera, Interaction, Rig, RigDescription, Touch, View};
use crate::base::{Error, Pose, Result};

/// A program that speaks the rig protocol. It is ended when this is dropped.
pub struct ProcessRig {
    command: String,
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    lines: usize,
    cameras: Vec<Camera>,
}

impl ProcessRig {
    /// Starts `command` by the shell; its standard error goes through to ours.
    ///
    /// # Errors
    /// [`Error::Failed`] where it cannot be started.
    pub fn start(command: &str) -> Result<Self> {
        let failed = |what: String| Error::Failed(format!("exec:{command}: {what}"));
        let mut child = Command::new("sh")
            .args(["-c", &format!("exec {command}")])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| failed(format!("cannot be started: {e}")))?;
        let input = child.stdin.take();
        let output = child.stdout.take().ok_or_else(|| failed("it has no output".into()))?;
        Ok(Self {
            command: command.to_owned(),
            child,
            input,
            output: BufReader::new(output),
            lines: 0,
            cameras: Vec::new(),
        })
    }

    fn died(&mut self) -> Error {
        self.input = None;
        let how = self
            .child
            .wait()
            .map_or_else(|e| e.to_string(), |status| status.to_string());
        Error::Failed(format!(
            "exec:{}: the rig ended ({how}) after {} lines, before it had answered",
            self.command, self.lines
        ))
    }

    fn ask(&mut self, question: &Value) -> Result<Line> {
        let mut text = question.to_string();
        text.push('\n');
        let sent = self
            .input
            .as_mut()
            .map(|input| input.write_all(text.as_bytes()).and_then(|()| input.flush()));
        if !matches!(sent, Some(Ok(()))) {
            return Err(self.died());
        }
        let mut bytes = Vec::new();
        let read = self.output.read_until(b'\n', &mut bytes);
        if !read.is_ok_and(|n| n > 0) {
            return Err(self.died());
        }
        self.lines += 1;
        let name = PathBuf::from(format!("exec:{}: line {}", self.command, self.lines));
        let text = String::from_utf8(bytes)
            .map_err(|_| Error::bad_input(&name, "the line", "bytes that are no UTF-8", "one JSON object"))?;
        Ok(Line { name, text })
    }
}

impl Drop for ProcessRig {
    fn drop(&mut self) {
        self.input = None;
        if !matches!(self.child.try_wait(), Ok(Some(_))) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

impl Rig for ProcessRig {
    fn describe(&mut self) -> Result<RigDescription> {
        let description = self
            .ask(&json!({ "ask": "describe", "protocol": RIG_PROTOCOL }))?
            .description()?;
        self.cameras.clone_from(&description.cameras);
        Ok(description)
    }

    fn look(&mut self, world_from_camera: &Pose) -> Result<Answer<View>> {
        let camera = self.cameras.first().map(|c| c.name.clone()).unwrap_or_default();
        let line = self.ask(&ask_look(&camera, world_from_camera))?;
        if let Some(why) = line.refusal()? {
            return Ok(Answer::Refused(why));
        }
        Ok(Answer::Done(line.view(&self.cameras)?))
    }

    fn touch(&mut self, touch: &Touch) -> Result<Answer<Interaction>> {
        let line = self.ask(&ask_touch(touch))?;
        if let Some(why) = line.refusal()? {
            return Ok(Answer::Refused(why));
        }
        Ok(Answer::Done(line.interaction(touch)?))
    }

    fn done(&mut self) -> Result<()> {
        self.ask(&json!({ "ask": "done" }))?.farewell()?;
        self.input = None;
        let _ = self.child.wait();
        Ok(())
    }
}
