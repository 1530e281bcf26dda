//! A three-stage pipeline over a sequence of items, such as the frames of an animation.

/// Runs `prepare`, `work` and `finish` on each of `count` items. While item i is worked on, item i + 1 is prepared and
/// item i − 1 is finished, all on the current thread pool. Items are finished in order.
///
/// `prepare(i, previous, recycled)` gets item i − 1, which is being worked on, and item i − 2, whose memory it may reuse.
///
/// # Errors
/// The first error of any stage; no item is started after it.
pub fn run_pipeline<T, D, E>(
    count: usize,
    mut prepare: impl FnMut(usize, Option<&T>, Option<T>) -> Result<T, E> + Send,
    work: impl Fn(usize, &T) -> Result<D, E> + Sync,
    mut finish: impl FnMut(usize, D) -> Result<(), E> + Send,
) -> Result<(), E>
where
    T: Send + Sync,
    D: Send,
    E: Send,
{
    let mut prepared = None;
    let mut recycled = None;
    let mut unfinished = None;
    for i in 0..count {
        let item = match prepared.take() {
            Some(item) => item,
            None => prepare(i, None, recycled.take())?,
        };
        let prepare_next = || match i + 1 < count {
            true => prepare(i + 1, Some(&item), recycled.take()).map(Some),
            false => Ok(None),
        };
        let finish_last = || unfinished.take().map_or(Ok(()), |result| finish(i - 1, result));
        let (result, (next, finished)) =
            rayon::join(|| work(i, &item), || rayon::join(prepare_next, finish_last));
        finished?;
        unfinished = Some(result?);
        prepared = next?;
        recycled = Some(item);
    }
    unfinished.map_or(Ok(()), |result| finish(count - 1, result))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn each_item_passes_all_stages_and_is_finished_in_order() {
        for count in 0..5 {
            let finished = Mutex::new(Vec::new());
            let done = run_pipeline(
                count,
                |i, previous, recycled| {
                    assert_eq!(previous, i.checked_sub(1).map(|b| b * 10).as_ref());
                    assert_eq!(recycled, i.checked_sub(2).map(|b| b * 10));
                    Ok::<_, ()>(i * 10)
                },
                |i, item| Ok((i, *item)),
                |i, result| {
                    assert_eq!(result, (i, i * 10));
                    finished.lock().unwrap().push(i);
                    Ok(())
                },
            );
            assert_eq!(done, Ok(()));
            assert_eq!(finished.into_inner().unwrap(), (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn after_an_error_earlier_items_are_finished() {
        let finished = Mutex::new(0);
        let run = |prepares: usize, works: usize| {
            *finished.lock().unwrap() = 0;
            run_pipeline(
                9,
                |i, _, _| if i == prepares { Err("prepare") } else { Ok(()) },
                |i, ()| if i == works { Err("work") } else { Ok(()) },
                |_, ()| {
                    *finished.lock().unwrap() += 1;
                    Ok(())
                },
            )
        };
        assert_eq!(run(99, 4), Err("work"));
        assert_eq!(*finished.lock().unwrap(), 4);
        assert_eq!(run(4, 99), Err("prepare"));
        // The item that was worked on meanwhile is lost.
        assert_eq!(*finished.lock().unwrap(), 3);
    }
}
