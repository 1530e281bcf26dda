//! Work of all viewers for the one thread that renders: the newest state of each, in fair turns.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use super::messages::{PickMessage, ViewMessage};
use super::outbox::Outbox;
use super::quality::NextFrame;
use crate::cancellation::CancelToken;

/// How often other viewers may interrupt a frame that is refined.
const MAX_INTERRUPTIONS: u32 = 3;

/// A viewer by its number.
pub type ViewerId = u64;

/// The work of all viewers.
#[derive(Default)]
pub struct Hub {
    state: Mutex<HubState>,
    is_due: Condvar,
    /// Tells that the scene was loaded again.
    is_reloaded: Condvar,
}

#[derive(Default)]
struct HubState {
    viewers: BTreeMap<ViewerId, Viewer>,
    next_id: ViewerId,
    /// The viewer that had the last turn.
    last: ViewerId,
    running: Option<Running>,
    needs_reload: bool,
    /// How often the scene was loaded again, or could not be.
    reloads: u64,
}

/// The frame that is being rendered.
struct Running {
    viewer: ViewerId,
    is_refinement: bool,
    cancel: CancelToken,
}

struct Viewer {
    outbox: Arc<Outbox>,
    needs_scene: bool,
    pick: Option<PickMessage>,
    /// The newest state, and the next frame of it.
    message: Option<Arc<ViewMessage>>,
    next: Option<NextFrame>,
    /// How often the frame was interrupted.
    interruptions: u32,
    /// Seconds for a sample of a pixel, from recent frames.
    cost: Option<f64>,
}

/// The next thing to do.
pub enum Turn {
    /// Load the scene again.
    Reload,
    Viewer {
        id: ViewerId,
        outbox: Arc<Outbox>,
        task: Task,
    },
}

/// Something to do for one viewer.
pub enum Task {
    /// Describe the scene.
    Scene,
    Pick {
        pick: PickMessage,
        message: Option<Arc<ViewMessage>>,
    },
    Frame {
        message: Arc<ViewMessage>,
        next: NextFrame,
        cost: Option<f64>,
        cancel: CancelToken,
    },
}

impl Hub {
    fn lock(&self) -> MutexGuard<'_, HubState> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Adds a viewer, who needs the scene first.
    pub fn join(&self, outbox: Arc<Outbox>) -> ViewerId {
        let mut state = self.lock();
        let id = state.next_id;
        state.next_id += 1;
        let viewer = Viewer {
            outbox,
            needs_scene: true,
            pick: None,
            message: None,
            next: None,
            interruptions: 0,
            cost: None,
        };
        state.viewers.insert(id, viewer);
        self.is_due.notify_one();
        id
    }

    /// Removes a viewer, with its frame.
    pub fn leave(&self, id: ViewerId) {
        let mut state = self.lock();
        state.viewers.remove(&id);
        state.cancel(|running| running.viewer == id);
    }

    /// Replaces the state of a viewer. Ends a frame of the one before, and lets a new picture come before the refinement
    /// of another viewer's.
    pub fn show(&self, id: ViewerId, message: ViewMessage) {
        let mut state = self.lock();
        let next = NextFrame::first_of(&message);
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.message = Some(Arc::new(message));
        viewer.next = Some(next);
        viewer.interruptions = 0;
        state.cancel(|running| running.viewer == id);
        state.interrupt_refinement();
        self.is_due.notify_one();
    }

    /// Asks what is at a pixel. Only the last question is kept.
    pub fn pick(&self, id: ViewerId, pick: PickMessage) {
        let mut state = self.lock();
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.pick = Some(pick);
        state.interrupt_refinement();
        self.is_due.notify_one();
    }

    /// True while a viewer waits for something.
    pub fn is_busy(&self, id: ViewerId) -> bool {
        let state = self.lock();
        let is_running = state.running.as_ref().is_some_and(|running| running.viewer == id);
        is_running || state.viewers.get(&id).is_some_and(Viewer::has_work)
    }

    /// Has the scene loaded again at the next turn, and waits until it is.
    pub fn reload(&self) {
        let mut state = self.lock();
        state.needs_reload = true;
        state.cancel(|_| true);
        self.is_due.notify_one();
        let before = state.reloads;
        while state.reloads == before {
            state = self.is_reloaded.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Notes that the scene was loaded again, or could not be.
    pub fn reloaded(&self) {
        self.lock().reloads += 1;
        self.is_reloaded.notify_all();
    }

    /// The messages that wait for all viewers.
    pub fn outboxes(&self) -> Vec<Arc<Outbox>> {
        self.lock().viewers.values().map(|viewer| viewer.outbox.clone()).collect()
    }

    /// The states that viewers show.
    pub fn messages(&self) -> Vec<(ViewerId, Option<Arc<ViewMessage>>)> {
        self.lock().viewers.iter().map(|(id, viewer)| (*id, viewer.message.clone())).collect()
    }

    /// Gives all viewers the scene again, with a state of the new one for each, and renders that.
    pub fn replace_scene(&self, messages: Vec<(ViewerId, Option<ViewMessage>)>) {
        let mut state = self.lock();
        for (id, message) in messages {
            let Some(viewer) = state.viewers.get_mut(&id) else { continue };
            viewer.needs_scene = true;
            viewer.cost = None;
            if let Some(message) = message {
                viewer.next = Some(NextFrame::first_of(&message));
                viewer.message = Some(Arc::new(message));
            }
        }
    }

    /// The newest state of a viewer.
    pub fn message(&self, id: ViewerId) -> Option<Arc<ViewMessage>> {
        self.lock().viewers.get(&id)?.message.clone()
    }

    /// Waits for work and takes the next turn: viewers in the order of their numbers, beginning after the last; what was
    /// asked for anew before what is refined.
    pub fn next_turn(&self) -> Turn {
        let mut state = self.lock();
        state.running = None;
        loop {
            if std::mem::take(&mut state.needs_reload) {
                return Turn::Reload;
            }
            if let Some(turn) = state.take_turn() {
                return turn;
            }
            state = self.is_due.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Notes that a frame is done, its cost, and the one after it, unless the viewer has another state by now.
    pub fn frame_done(&self, id: ViewerId, serial: u64, cost: Option<f64>, next: Option<NextFrame>) {
        let mut state = self.lock();
        state.running = None;
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.cost = match (viewer.cost, cost) {
            (Some(old), Some(new)) => Some(0.5 * (old + new)),
            (old, new) => new.or(old),
        };
        if viewer.next.is_none() && viewer.message.as_ref().is_some_and(|message| message.serial == serial) {
            viewer.next = next;
        }
    }

    /// Notes that a frame was cancelled. Another viewer's interruption repeats it.
    pub fn frame_cancelled(&self, id: ViewerId, serial: u64, next: NextFrame) {
        let mut state = self.lock();
        state.running = None;
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        if viewer.next.is_none() && viewer.message.as_ref().is_some_and(|message| message.serial == serial) {
            viewer.next = Some(next);
            viewer.interruptions += 1;
        }
    }
}

impl Viewer {
    fn has_work(&self) -> bool {
        self.needs_scene || self.pick.is_some() || self.next.is_some()
    }
}

impl HubState {
    fn cancel(&self, condition: impl Fn(&Running) -> bool) {
        if let Some(running) = self.running.as_ref().filter(|running| condition(running)) {
            running.cancel.cancel();
        }
    }

    /// Ends a refinement, unless that happened too often.
    fn interrupt_refinement(&self) {
        self.cancel(|running| {
            let viewer = self.viewers.get(&running.viewer);
            running.is_refinement && viewer.is_none_or(|viewer| viewer.interruptions < MAX_INTERRUPTIONS)
        });
    }

    fn take_turn(&mut self) -> Option<Turn> {
        let after = self.viewers.range(self.last + 1..).map(|(id, viewer)| (*id, viewer));
        let before = self.viewers.range(..=self.last).map(|(id, viewer)| (*id, viewer));
        let order: Vec<(ViewerId, bool, bool)> = after
            .chain(before)
            .map(|(id, viewer)| {
                let is_refined = viewer.next.is_some_and(NextFrame::is_refinement);
                let is_new =
                    viewer.needs_scene || viewer.pick.is_some() || (viewer.next.is_some() && !is_refined);
                (id, is_new, viewer.has_work())
            })
            .collect();
        let first_new = order.iter().find(|(_, is_new, _)| *is_new);
        let (id, ..) = *first_new.or_else(|| order.iter().find(|(.., has_work)| *has_work))?;
        self.last = id;
        let viewer = self.viewers.get_mut(&id)?;
        let outbox = viewer.outbox.clone();
        let message = viewer.message.clone();
        let task = if std::mem::take(&mut viewer.needs_scene) {
            Task::Scene
        } else if let Some(pick) = viewer.pick.take() {
            Task::Pick { pick, message }
        } else {
            let next = viewer.next.take()?;
            let cancel = CancelToken::new();
            let is_refinement = next.is_refinement();
            self.running = Some(Running { viewer: id, is_refinement, cancel: cancel.clone() });
            Task::Frame { message: message?, next, cost: viewer.cost, cancel }
        };
        Some(Turn::Viewer { id, outbox, task })
    }
}
