//! One thing after another, with all processors busy.

/// Takes `count` things through three steps: `prepare`, `work`, `finish`. While one is worked on,
/// the next is prepared and the one before it finished, all on the threads that there are; things
/// are finished in their order. `prepare` is given the thing before, which is still worked on, and
/// the one before that, to make what it makes out of.
///
/// # Errors
/// The first error of any step; nothing is begun after it.
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
    let (mut ready, mut spent, mut done) = (None, None, None);
    for i in 0..count {
        let now = match ready.take() {
            Some(now) => now,
            None => prepare(i, None, spent.take())?,
        };
        let next = || match i + 1 < count {
            true => prepare(i + 1, Some(&now), spent.take()).map(Some),
            false => Ok(None),
        };
        let last = || done.take().map_or(Ok(()), |done| finish(i - 1, done));
        let (made, (next, finished)) = rayon::join(|| work(i, &now), || rayon::join(next, last));
        finished?;
        done = Some(made?);
        ready = next?;
        spent = Some(now);
    }
    done.map_or(Ok(()), |done| finish(count - 1, done))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn everything_is_prepared_once_worked_on_and_finished_in_order() {
        for count in 0..5 {
            let finished = Mutex::new(Vec::new());
            let done = run_pipeline(
                count,
                |i, before, spent| {
                    assert_eq!(before, i.checked_sub(1).map(|b| b * 10).as_ref());
                    assert_eq!(spent, i.checked_sub(2).map(|b| b * 10));
                    Ok::<_, ()>(i * 10)
                },
                |i, thing| Ok((i, *thing)),
                |i, made| {
                    assert_eq!(made, (i, i * 10));
                    finished.lock().unwrap().push(i);
                    Ok(())
                },
            );
            assert_eq!(done, Ok(()));
            assert_eq!(finished.into_inner().unwrap(), (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn an_error_ends_it_and_what_was_made_before_is_finished() {
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
        // The one that was worked on meanwhile is lost with it.
        assert_eq!(*finished.lock().unwrap(), 3);
    }
}
