/* layer.h - the names of what a film can hold (SCENE section 4).
 *
 * Beauty and albedo are means over the pixel's samples. Depth, normal and
 * object_id are data, of which no mean makes sense: they come from the pixel's
 * sample 0. */
#ifndef CORE_SCENE_LAYER_H
#define CORE_SCENE_LAYER_H

/* C name, document name, channels, kind in the EXR manifest */
#define LAYER_TABLE(X)                                                         \
    X(LAYER_BEAUTY, "beauty", 3, "color")                                      \
    X(LAYER_DEPTH, "depth", 1, "scalar")   /* along the unit ray; miss +inf */ \
    X(LAYER_NORMAL, "normal", 3, "vector") /* shading, world, as stored */     \
    X(LAYER_ALBEDO, "albedo", 3, "color")                                      \
    X(LAYER_OBJECT_ID, "object_id", 1, "scalar") /* 1-based; 0: none */

enum layer {
#define X(id, name, channels, kind) id,
    LAYER_TABLE(X)
#undef X
        LAYER_COUNT
};

#endif
