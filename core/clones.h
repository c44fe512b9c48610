/**
 * WEFT_CLONES before a function builds it for several x86-64 levels from the one source; the loader picks.
 *
 * For hot loops over planar rows, where it was measured to help.  Every level gives the same bits: the
 * folders that use it are built with -ffp-contract=off, so no level fuses a multiply and an add.
 * Empty under sanitizers (their run-time is not ready when the loader resolves) and on other machines.
 */
#ifndef WEFT_CORE_CLONES_H
#define WEFT_CORE_CLONES_H

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) &&     \
    !defined(__SANITIZE_THREAD__)
#define WEFT_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define WEFT_CLONES
#endif

/** Before a helper that such a function calls: it becomes part of each copy, where a plain call would stay
 *  at the lowest level. */
#if defined(__GNUC__)
#define WEFT_INLINE static inline __attribute__((always_inline))
#else
#define WEFT_INLINE static inline
#endif

/** Before a loop: no iteration reads what another one writes (the planes do not overlap), so that the
 *  compiler need not check every pair of pointers, which it gives up above a handful. */
#if defined(__GNUC__) && !defined(__clang__)
#define WEFT_INDEPENDENT _Pragma("GCC ivdep")
#elif defined(__clang__)
#define WEFT_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define WEFT_INDEPENDENT
#endif

#endif
