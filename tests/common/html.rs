//! Checks of HTML pages.

/// Checks that the page has tables, and that all rows of each have as many cells. Returns the number of rows.
#[track_caller]
pub fn assert_even_tables(page: &str) -> usize {
    let mut count = 0;
    let tables: Vec<&str> = page.split("<table").skip(1).collect();
    assert!(!tables.is_empty(), "no table");
    for table in tables {
        let table = table.split("</table>").next().unwrap();
        let rows = table.split("<tr").skip(1);
        let cells: Vec<usize> = rows.map(|row| count_cells(row.split("</tr>").next().unwrap())).collect();
        assert!(
            cells[0] > 0 && cells.iter().all(|cells_of_row| *cells_of_row == cells[0]),
            "{cells:?}: {table}"
        );
        count += cells.len();
    }
    count
}

fn count_cells(row: &str) -> usize {
    let is_cell = |tag: &&str| matches!(tag.as_bytes(), [b'd' | b'h', b'>' | b' ', ..]);
    row.split("<t").skip(1).filter(is_cell).count()
}
