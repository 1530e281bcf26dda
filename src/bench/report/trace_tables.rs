//! The bounds of a job by its traces, as tables and as a page.

use super::page_head;
use super::table::{Table, texts};
use super::units::format_duration;
use crate::trace::{SpeedUp, TraceBound, TracedStage};

/// Tables of work and critical path, of the stages and of the speed-ups.
pub fn trace_tables(bound: &TraceBound) -> Vec<Table> {
    vec![work_table(bound), stage_table(bound), speed_up_table(&bound.speed_ups)]
}

/// The HTML page of the bounds.
pub fn trace_page(bound: &TraceBound) -> String {
    let mut page = page_head("blinn bench: speed-up by more cores");
    page += "<p class=\"facts\">Bounds from the times of stages: at most the work divided by the critical path, and at least \
             what Brent's theorem gives cores that are never idle while there is something to do. Memory, caches and clocks \
             are not in them.</p>\n";
    page += &trace_tables(bound).iter().map(Table::to_html).collect::<String>();
    page + "</body></html>\n"
}

fn work_table(bound: &TraceBound) -> Table {
    let TraceBound { work_seconds: work, outside_seconds, span_seconds: span, .. } = *bound;
    let ratio = |seconds: f64| if seconds > 0.0 { format!("{:.1}", work / seconds) } else { "–".into() };
    let threads: Vec<String> = bound.threads.iter().map(u32::to_string).collect();
    let row = |name: &str, least: String, most: String| vec![name.to_string(), least, most];
    let both = |name: &str, value: String| row(name, value.clone(), value);
    Table {
        title: format!("Work and critical path, by traces of {} threads", threads.join(" and ")),
        head: texts(["", "least", "most"]),
        rows: vec![
            both("work", format_duration(work)),
            both("outside of scenes", format_duration(outside_seconds)),
            row("critical path", format_duration(span.least), format_duration(span.most)),
            row("work / critical path", ratio(span.most), ratio(span.least)),
            both("longest scene", bound.longest_scene.clone()),
        ],
    }
}

fn stage_table(bound: &TraceBound) -> Table {
    let row = |TracedStage { stage, count, work_seconds, serial_fraction }: &TracedStage| {
        let share = if bound.work_seconds > 0.0 { work_seconds / bound.work_seconds } else { 0.0 };
        let percent = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
        vec![
            stage.clone(),
            count.to_string(),
            format_duration(*work_seconds),
            percent(share),
            serial_fraction.map_or_else(|| "–".into(), percent),
        ]
    };
    Table {
        title: "Stages".into(),
        head: texts(["stage", "count", "work", "share", "serial"]),
        rows: bound.stages.iter().map(row).collect(),
    }
}

fn speed_up_table(speed_ups: &[SpeedUp]) -> Table {
    let row = |SpeedUp { cores, at_least, at_most }: &SpeedUp| {
        vec![cores.to_string(), format!("{at_least:.2}"), format!("{at_most:.2}")]
    };
    Table {
        title: "Speed-up over one core".into(),
        head: texts(["cores", "at least", "at most"]),
        rows: speed_ups.iter().map(row).collect(),
    }
}
