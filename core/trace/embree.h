/* embree.h - Embree 3 and Embree 4 as one: what differs between them.
 *
 * Only accel.c includes it. CMake says which was found (GLINT_EMBREE). */
#ifndef CORE_TRACE_EMBREE_H
#define CORE_TRACE_EMBREE_H

#include <stdbool.h>

#if GLINT_EMBREE == 4
#include <embree4/rtcore.h>

typedef struct RTCRayQueryContext embree_context;

static inline void
embree_context_init(embree_context *context)
{
    rtcInitRayQueryContext(context);
}

static inline struct RTCIntersectArguments
embree_intersect_arguments(embree_context *context, bool coherent)
{
    struct RTCIntersectArguments a;
    rtcInitIntersectArguments(&a);
    a.context = context;
    a.flags =
        coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    return a;
}

static inline struct RTCOccludedArguments
embree_occluded_arguments(embree_context *context, bool coherent)
{
    struct RTCOccludedArguments a;
    rtcInitOccludedArguments(&a);
    a.context = context;
    a.flags =
        coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    return a;
}

#define EMBREE_INTERSECT(n, valid, scene, context, coherent, rayhit)           \
    do {                                                                       \
        struct RTCIntersectArguments a_ =                                      \
            embree_intersect_arguments(context, coherent);                     \
        rtcIntersect##n(valid, scene, rayhit, &a_);                            \
    } while (0)
#define EMBREE_INTERSECT1(scene, context_, coherent, rayhit)                   \
    do {                                                                       \
        struct RTCIntersectArguments a_ =                                      \
            embree_intersect_arguments(context_, coherent);                    \
        rtcIntersect1(scene, rayhit, &a_);                                     \
    } while (0)
#define EMBREE_OCCLUDED(n, valid, scene, context, coherent, ray)               \
    do {                                                                       \
        struct RTCOccludedArguments a_ =                                       \
            embree_occluded_arguments(context, coherent);                      \
        rtcOccluded##n(valid, scene, ray, &a_);                                \
    } while (0)
#define EMBREE_OCCLUDED1(scene, context_, coherent, ray)                       \
    do {                                                                       \
        struct RTCOccludedArguments a_ =                                       \
            embree_occluded_arguments(context_, coherent);                     \
        rtcOccluded1(scene, ray, &a_);                                         \
    } while (0)

#else
#include <embree3/rtcore.h>

typedef struct RTCIntersectContext embree_context;

static inline void
embree_context_init(embree_context *context)
{
    rtcInitIntersectContext(context);
}

static inline void
embree_coherent(embree_context *context, bool coherent)
{
    context->flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                              : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}

#define EMBREE_INTERSECT(n, valid, scene, context, coherent, rayhit)           \
    do {                                                                       \
        embree_coherent(context, coherent);                                    \
        rtcIntersect##n(valid, scene, context, rayhit);                        \
    } while (0)
#define EMBREE_INTERSECT1(scene, context, coherent, rayhit)                    \
    do {                                                                       \
        embree_coherent(context, coherent);                                    \
        rtcIntersect1(scene, context, rayhit);                                 \
    } while (0)
#define EMBREE_OCCLUDED(n, valid, scene, context, coherent, ray)               \
    do {                                                                       \
        embree_coherent(context, coherent);                                    \
        rtcOccluded##n(valid, scene, context, ray);                            \
    } while (0)
#define EMBREE_OCCLUDED1(scene, context, coherent, ray)                        \
    do {                                                                       \
        embree_coherent(context, coherent);                                    \
        rtcOccluded1(scene, context, ray);                                     \
    } while (0)
#endif

#endif
