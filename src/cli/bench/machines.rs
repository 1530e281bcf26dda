//! Shows the results of several machines side by side.

use super::output::{fail, print, write};
use super::table;
use crate::args::BenchArgs;
use crate::summary::Summary;
use blinn_bench::{MachineResults, Table, different_work, machines_page, result_tables};

/// Prints and writes tables of several machines. Different hashes are an error: the machines did different work.
pub fn show(args: &BenchArgs, machines: &[MachineResults], summary: &mut Summary) {
    let tables = result_tables(machines);
    print(args, &table::text(&tables), summary);
    write(summary, args, args.report.as_deref(), || machines_page(machines));
    write(summary, args, args.markdown.as_deref(), || markdown(&tables));
    for text in different_work(machines) {
        fail(summary, &text);
    }
}

/// The text of --markdown.
pub fn markdown(tables: &[Table]) -> String {
    tables.iter().map(Table::to_markdown).collect::<Vec<_>>().join("\n")
}
