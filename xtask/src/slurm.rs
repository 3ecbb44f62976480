//! The array script and the Slurm profile of workflow/ on a real Slurm: one node on this machine, with its daemons under target/.
//!
//! There is no accounting database.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use crate::python::printed;
use xtask::workspace;

/// Programs of Debian's slurm-wlm and munge.
const DAEMONS: [&str; 3] = ["munged", "slurmctld", "slurmd"];
/// Longest wait for a job.
const PATIENCE: Duration = Duration::from_secs(300);

/// A Slurm of one node, ended with the value.
pub(crate) struct Slurm {
    folder: PathBuf,
    daemons: Vec<Process>,
}

/// A process, killed with the value.
pub(crate) struct Process(Child);

impl Process {
    /// Starts it.
    pub(crate) fn start(command: &mut Command) -> Result<Self> {
        Ok(Self(command.spawn().with_context(|| format!("cannot start {command:?}"))?))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Slurm {
    /// Starts it in `folder`; none where it is not installed or this is not root.
    pub(crate) fn start(folder: &Path) -> Result<Option<Self>> {
        let is_root = printed(Command::new("id").arg("-u")).is_ok_and(|id| id.trim() == "0");
        let found = |daemon: &&str| Path::new("/usr/sbin").join(daemon).exists();
        if !is_root || !DAEMONS.iter().all(found) {
            return Ok(None);
        }
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        fs::create_dir_all(folder.join("state"))?;
        fs::write(folder.join("slurm.conf"), configuration(folder))?;
        // Steps of Snakemake lose SLURM_CONF.
        let step = folder.join("srun");
        let conf = folder.join("slurm.conf");
        let lines = format!("#!/bin/sh\nSLURM_CONF='{}' exec /usr/bin/srun \"$@\"\n", conf.display());
        fs::write(&step, lines)?;
        printed(Command::new("chmod").arg("755").arg(&step))?;
        // The owner alone may read a key.
        let key = folder.join("key");
        printed(
            Command::new("dd")
                .args(["if=/dev/urandom", "bs=1024", "count=1", "status=none"])
                .arg(format!("of={}", key.display())),
        )?;
        printed(Command::new("chmod").arg("600").arg(&key))?;
        let mut slurm = Self { folder: folder.to_owned(), daemons: Vec::new() };
        let place = |option: &str, name: &str| format!("--{option}={}", folder.join(name).display());
        slurm.daemon(
            "munged",
            &[
                "--foreground",
                "--force",
                &place("key-file", "key"),
                &place("socket", "munge.socket"),
                &place("pid-file", "munge.pid"),
                &place("log-file", "munge.log"),
                &place("seed-file", "munge.seed"),
            ],
        )?;
        wait("munged", || Ok(folder.join("munge.socket").exists()))?;
        slurm.daemon("slurmctld", &["-D", "-c"])?;
        slurm.daemon("slurmd", &["-D"])?;
        wait("the node", || slurm.node_is("idle"))?;
        Ok(Some(slurm))
    }

    fn daemon(&mut self, name: &str, arguments: &[&str]) -> Result<()> {
        let log = fs::File::create(self.folder.join(format!("{name}.out")))?;
        let mut command = Command::new(Path::new("/usr/sbin").join(name));
        command.args(arguments).env("SLURM_CONF", self.folder.join("slurm.conf"));
        command.stdout(log.try_clone()?).stderr(log).stdin(Stdio::null());
        self.daemons.push(Process::start(&mut command)?);
        Ok(())
    }

    /// A client of this Slurm.
    pub(crate) fn client(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new(program.as_ref());
        command.envs(self.environment()).current_dir(workspace::root());
        command
    }

    /// What clients need to find it.
    pub(crate) fn environment(&self) -> [(&'static str, PathBuf); 1] {
        [("SLURM_CONF", self.folder.join("slurm.conf"))]
    }

    /// The folder of the `srun` of this Slurm.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// What a client prints.
    fn said(&self, words: &[&str]) -> Result<String> {
        printed(self.client(words[0]).args(&words[1..]))
    }

    fn node_is(&self, state: &str) -> Result<bool> {
        Ok(self.said(&["sinfo", "--noheader", "--format=%T"]).unwrap_or_default().trim() == state)
    }

    /// Waits until no job is left.
    pub(crate) fn settle(&self) -> Result<()> {
        wait("jobs", || Ok(self.said(&["squeue", "--noheader"])?.trim().is_empty()))
    }

    /// The first running job whose line `NUMBER COMMENT` is `wanted`, and its comment; waits for one.
    pub(crate) fn running(&self, mut wanted: impl FnMut(&str) -> bool) -> Result<(String, String)> {
        let mut found = None;
        wait("a running job", || {
            let running = self.said(&["squeue", "--noheader", "--states=RUNNING", "--format=%i %k"])?;
            found = running
                .lines()
                .find(|line| wanted(line))
                .and_then(|line| line.split_once(' '))
                .map(|(job, comment)| (job.to_owned(), comment.to_owned()));
            Ok(found.is_some())
        })?;
        found.context("a job that was found")
    }

    /// Ends a job.
    pub(crate) fn cancel(&self, job: &str) -> Result<()> {
        self.said(&["scancel", job]).map(drop)
    }

    /// Lets the node fail under its jobs; it comes back by itself.
    pub(crate) fn fail_node(&self) -> Result<()> {
        self.said(&["scontrol", "update", "NodeName=localhost", "State=DOWN", "Reason=test"]).map(drop)
    }
}

fn wait(what: &str, mut done: impl FnMut() -> Result<bool>) -> Result<()> {
    let begun = Instant::now();
    while !done()? {
        ensure!(begun.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(200));
    }
    Ok(())
}

fn configuration(folder: &Path) -> String {
    let folder = folder.display();
    format!(
        "ClusterName=accept\nSlurmctldHost=localhost\nSlurmUser=root\nAuthType=auth/munge\nCryptoType=crypto/munge\n\
         AuthInfo=socket={folder}/munge.socket\nSlurmctldPort=26817\nSlurmdPort=26818\nStateSaveLocation={folder}/state\n\
         SlurmdSpoolDir={folder}/spool\nSlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd.pid\n\
         SlurmctldLogFile={folder}/slurmctld.log\nSlurmdLogFile={folder}/slurmd.log\nProctrackType=proctrack/linuxproc\n\
         TaskPlugin=task/none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nMpiDefault=none\n\
         JobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\nReturnToService=2\nKillWait=2\n\
         NodeName=localhost CPUs=2 RealMemory=2000 State=UNKNOWN\nPartitionName=all Nodes=ALL Default=YES State=UP\n"
    )
}
