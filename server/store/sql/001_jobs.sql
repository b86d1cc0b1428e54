-- 001: jobs, their scenes, and whose turn it is.
--
-- Numbers stored for state (0 queued, 1 running, 2 succeeded, 3 failed,
-- 4 canceled), phase and priority are those of server/jobs/job.h and are never
-- renumbered. Errors are stored by their public name. Times: ms since 1970.

CREATE TABLE jobs (
    seq INTEGER PRIMARY KEY, -- order of submission
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    priority INTEGER NOT NULL,
    rank INTEGER NOT NULL,   -- virtual start time, server/jobs/rank.h
    short INTEGER NOT NULL,  -- may run in the short lane
    max_attempts INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,
    scene_hash TEXT NOT NULL,
    render_key TEXT NOT NULL,
    output TEXT NOT NULL,
    tags TEXT NOT NULL,
    settings TEXT NOT NULL,
    estimate_rays REAL NOT NULL,
    estimate_seconds REAL NOT NULL,
    estimate_bytes REAL NOT NULL,
    no_cache INTEGER NOT NULL,
    media_type TEXT NOT NULL,
    -- below: what changes
    state INTEGER NOT NULL,
    phase INTEGER NOT NULL,
    cancel_requested INTEGER NOT NULL,
    revision INTEGER NOT NULL,
    epoch INTEGER NOT NULL,
    attempt INTEGER NOT NULL,
    progress REAL NOT NULL,
    rays_done INTEGER NOT NULL,
    started_ms INTEGER NOT NULL,
    finished_ms INTEGER NOT NULL,
    result TEXT NOT NULL,
    result_len INTEGER NOT NULL,
    rays_camera INTEGER NOT NULL,
    rays_shadow INTEGER NOT NULL,
    rays_bounce INTEGER NOT NULL,
    queue_ms REAL NOT NULL,
    load_ms REAL NOT NULL,
    build_ms REAL NOT NULL,
    trace_ms REAL NOT NULL,
    encode_ms REAL NOT NULL,
    peak_bytes INTEGER NOT NULL,
    error TEXT NOT NULL,
    error_text TEXT NOT NULL
) STRICT;

-- The next job, in any lane and in the short one: only queued jobs are in
-- these, so a million finished ones cost nothing.
CREATE INDEX jobs_waiting ON jobs (priority, rank, seq) WHERE state = 0;
CREATE INDEX jobs_waiting_short ON jobs (priority, rank, seq)
    WHERE state = 0 AND short = 1;
-- Whose leases are void at the next start.
CREATE INDEX jobs_running ON jobs (seq) WHERE state = 1;
-- Lists of one owner, newest first, any set of states.
CREATE INDEX jobs_by_owner ON jobs (owner, state, id);
-- The result cache.
CREATE INDEX jobs_by_render_key ON jobs (render_key, owner, seq)
    WHERE state = 2 AND no_cache = 0;
CREATE INDEX jobs_by_result ON jobs (result) WHERE result <> '';

CREATE TABLE scenes (
    seq INTEGER PRIMARY KEY REFERENCES jobs (seq) ON DELETE CASCADE,
    text BLOB NOT NULL
) STRICT;

-- Where each owner's last turn ends, and the clock of each priority.
CREATE TABLE turns (
    owner TEXT NOT NULL,
    priority INTEGER NOT NULL,
    end_us INTEGER NOT NULL,
    PRIMARY KEY (owner, priority)
) STRICT, WITHOUT ROWID;
CREATE TABLE clocks (
    priority INTEGER PRIMARY KEY,
    now_us INTEGER NOT NULL
) STRICT;
INSERT INTO clocks (priority, now_us) VALUES (0, 0), (1, 0), (2, 0);

-- Jobs by state, so that opening a long record is quick.
CREATE TABLE counts (
    state INTEGER PRIMARY KEY,
    jobs INTEGER NOT NULL CHECK (jobs >= 0)
) STRICT;
INSERT INTO counts (state, jobs) VALUES (0, 0), (1, 0), (2, 0), (3, 0), (4, 0);

PRAGMA user_version = 1;
