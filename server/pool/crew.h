/* crew.h - how many threads each running job gets. Pure; any thread. */
#ifndef SERVER_POOL_CREW_H
#define SERVER_POOL_CREW_H

/* The share of the job at `index` among `running` ones, index < running: the
 * shares differ by at most one, are at least one each, and add up to `threads`
 * unless there are more jobs than threads. */
unsigned
crew_share(unsigned threads, unsigned running, unsigned index);

#endif
