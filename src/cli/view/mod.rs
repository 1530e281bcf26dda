//! `blinn view`: a page on the loopback interface that shows a scene and finds its camera.
//!
//! The page sends the state of the view; it becomes options of `blinn render`, and frames are rendered with these. One
//! thread renders for all viewers, each of which has a thread for its connection; another looks at the files.

mod access;
mod commands;
mod flags;
mod frame;
mod hub;
mod loaded_scene;
mod messages;
mod open;
mod outbox;
mod page;
mod pick;
mod picture_plans;
mod quality;
mod remote;
mod renderer;
mod request;
mod response;
mod scene_cache;
mod scene_message;
mod server;
mod socket;
mod start_flags;
mod start_state;
mod state;
mod token;
mod view_scene;
mod visibility;

use std::ffi::OsString;
use std::io::{IsTerminal, stderr};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread;

use anyhow::Result;
use serde_json::json;

use super::args::{ServerArgs, ViewArgs};
use super::console::{print_error, print_hint, print_stdout, print_warning, scene_error, single_line};
use super::plan::scene_list;
use super::run::{panics, runtime};
use super::scene_file::is_stdin;
use super::summary::Summary;
use super::usage::UsageError;
use super::watched_files::WatchedFiles;
use access::Access;
use blinn_core::option_words::word_options;
use hub::Hub;
use picture_plans::PicturePlans;
use renderer::Renderer;
use server::Server;
use start_flags::StartFlags;

/// Maximum number of scenes of a page.
const MAX_SCENES: usize = 10_000;

/// The hint on a terminal.
const OPEN: &str = "open the address in a browser, or add `open`; Ctrl-C ends the program";

/// Shows a scene until the process ends. `argv` is the command line.
pub fn run(args: &ViewArgs, argv: &[OsString]) -> Result<Summary, UsageError> {
    let files = check(args)?;
    let path = files.first().cloned().unwrap_or_default();
    let plans = PicturePlans::new(files, StartFlags::parse(argv), args.process.max_memory);
    let outcome = match runtime::start(args.process.threads) {
        Ok(()) => {
            plans.start_plan()?;
            panics::catch(|| serve(args, plans))
        }
        Err(error) => Err(error),
    };
    let mut summary = Summary::default();
    if let Err(error) = outcome {
        let line = single_line(&scene_error(&path, &error));
        print_error(&line);
        summary.add_scene(Some(line));
    }
    Ok(summary)
}

/// Checks the options, and returns the scenes.
fn check(args: &ViewArgs) -> Result<Vec<PathBuf>, UsageError> {
    let no_picture = ["aov", "depth-unit", "crop"];
    if let Some(name) = no_picture.into_iter().find(|name| args.options.given.contains(name)) {
        return Err(UsageError(format!(
            "--{name}: the page shows whole pictures; remove it, and add it to the copied command"
        )));
    }
    let scenes = scene_list(&args.scene.scenes)?;
    if scenes.len() > MAX_SCENES {
        return Err(UsageError(format!(
            "the page lists up to {MAX_SCENES} scenes, not {}; name a smaller folder",
            scenes.len()
        )));
    }
    let scenes = scenes.to_vec()?;
    if scenes.iter().any(|scene| is_stdin(scene)) {
        return Err(UsageError("the page shows a file, which it reads again; save standard input".into()));
    }
    Ok(scenes)
}

/// Serves the page, and renders for it. Returns only with an error.
fn serve(args: &ViewArgs, plans: PicturePlans) -> Result<()> {
    let hub = Arc::new(Hub::default());
    // A port that is in use is known before the scene is loaded.
    let server = Server::bind(args.server.port.unwrap_or(0), access(&args.server), hub.clone())?;
    let renderer = Renderer::new(hub.clone(), plans)?;
    let url = server.url()?;
    let is_terminal = stderr().is_terminal() && !args.server.open;
    let is_reached_by_flags = args.server.base_url.is_some() || !args.server.allow_host.is_empty();
    let hint = remote::hint(server.port()?, |name| std::env::var(name).ok())
        .filter(|_| !is_reached_by_flags)
        .or_else(|| is_terminal.then(|| word_options(OPEN)))
        .filter(|_| !args.common.quiet);
    let watched = renderer.watched();
    thread::Builder::new().name("files".into()).spawn(move || watch(&watched, &hub))?;
    thread::Builder::new().name("server".into()).spawn(move || server.run())?;
    let line = if args.server.json { json!({"url": url}).to_string() } else { url.clone() };
    print_stdout(format!("{line}\n").as_bytes())?;
    if let Some(hint) = hint {
        print_hint(&hint);
    }
    if args.server.open
        && let Err(error) = open::in_browser(&url)
    {
        print_warning(&format!("--open: {error:#}; open the address yourself"));
    }
    renderer.run();
    Ok(())
}

fn access(args: &ServerArgs) -> Access {
    Access { base_url: args.base_url.clone(), hosts: args.allow_host.clone() }
}

/// Has the scene loaded again when its files change.
fn watch(watched: &Mutex<WatchedFiles>, hub: &Hub) {
    loop {
        WatchedFiles::pause();
        let files = watched.lock().unwrap_or_else(|e| e.into_inner()).clone();
        if files.have_changed() {
            files.wait_until_quiet();
            hub.reload();
        }
    }
}
