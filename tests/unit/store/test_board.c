/* Progress in memory, laid over rows. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/store/board.h"

static struct job
running(const char *id, uint32_t epoch, uint32_t revision, double progress)
{
    struct job job = {.state = JOB_RUNNING,
                      .phase = JOB_TRACING,
                      .epoch = epoch,
                      .revision = revision,
                      .progress = progress,
                      .rays_done = revision * 10};
    snprintf(job.id, sizeof job.id, "%s", id);
    return job;
}

static void
what_is_noted_is_found_until_wiped(void **state)
{
    (void)state;
    struct board board = {0};
    struct board_entry entry;
    char id[ID_SIZE];
    for (uint32_t i = 0; i < 100; i++) {
        snprintf(id, sizeof id, "job_%u", i);
        struct job job = running(id, 1, 5 + i, 0.5);
        board_note(&board, &job);
        job.revision++;
        board_note(&board, &job); /* one entry per job */
    }
    assert_int_equal(board.count, 100);
    for (uint32_t i = 0; i < 100; i++) {
        snprintf(id, sizeof id, "job_%u", i);
        assert_true(board_find(&board, id, &entry));
        assert_int_equal(entry.revision, 6 + i);
        board_wipe(&board, id);
        board_wipe(&board, id);
        assert_false(board_find(&board, id, &entry));
    }
    assert_int_equal(board.count, 0);
    board_clear(&board);
    board_clear(&board);
}

static void
only_what_is_ahead_of_the_row_is_laid_over_it(void **state)
{
    (void)state;
    struct board board = {0};
    struct board_entry entry;
    struct job noted = running("job_a", 2, 9, 0.75);
    board_note(&board, &noted);
    assert_true(board_find(&board, "job_a", &entry));

    struct job row = running("job_a", 2, 5, 0);
    row.phase = JOB_LOADING;
    board_lay(&entry, &row);
    assert_memory_equal(&row, &noted, sizeof row);

    /* A later change of the row, another lease, an end: the row holds. */
    struct job rows[] = {
        running("job_a", 2, 9, 0.1), running("job_a", 2, 10, 0.1),
        running("job_a", 3, 5, 0.1), running("job_a", 1, 5, 0.1),
        running("job_a", 2, 5, 1)};
    rows[4].state = JOB_SUCCEEDED;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct job before = rows[i];
        board_lay(&entry, &rows[i]);
        assert_memory_equal(&rows[i], &before, sizeof before);
    }
    board_clear(&board);
}

int
main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_noted_is_found_until_wiped),
        cmocka_unit_test(only_what_is_ahead_of_the_row_is_laid_over_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
