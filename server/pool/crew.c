#include "server/pool/crew.h"

#include "core/base/must.h"

unsigned
crew_share(unsigned threads, unsigned running, unsigned index)
{
    MUST(running > 0 && index < running);
    unsigned share = threads / running + (index < threads % running ? 1 : 0);
    return share > 0 ? share : 1;
}
