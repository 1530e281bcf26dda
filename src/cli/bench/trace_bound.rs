//! `blinn bench --trace-bound`: the speed-up that more cores could give a job, from traces of it.

use super::output::{fail, print, write};
use super::{check_outputs, machines, table};
use crate::args::BenchArgs;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_bench::{Trace, TraceBound, trace_csv, trace_page, trace_tables};

/// Prints and writes the bounds.
pub fn run(args: &BenchArgs) -> Result<Summary, UsageError> {
    let traces: Result<Vec<Trace>, _> = args.trace_bound.iter().map(|file| Trace::read(file)).collect();
    let traces = traces.map_err(|e| UsageError(format!("--trace-bound: {e}")))?;
    let bound = TraceBound::new(&traces).map_err(|e| UsageError(format!("--trace-bound: {e}")))?;
    let mut summary = Summary::default();
    if let Err(error) = check_outputs(args, &args.trace_bound)? {
        fail(&mut summary, &format!("{error:#}"));
        return Ok(summary);
    }
    let tables = trace_tables(&bound);
    print(args, &table::text(&tables), &mut summary);
    write(&mut summary, args, args.json.as_deref(), || bound.to_json());
    write(&mut summary, args, args.csv.as_deref(), || trace_csv(&bound));
    write(&mut summary, args, args.report.as_deref(), || trace_page(&bound));
    write(&mut summary, args, args.markdown.as_deref(), || machines::markdown(&tables));
    Ok(summary)
}
