/** Inheritance of records; used by the resolver alone. */
#ifndef WEFT_SHADING_MATERIAL_ASSET_MERGE_H
#define WEFT_SHADING_MATERIAL_ASSET_MERGE_H

#include "shading/material/radattr.h"

/**
 * The members of `base` with those of `own` over them (S-ORD-25): records merge member by member, unless the
 * own record names a base; everything else replaces.  Neither input changes; values are shared.
 *
 * Notes an error where a property is of another kind than in the base.
 * @param out  gets the members in the order of the base, then what is new
 */
void weft_rad_merge(const weft_rad_record *base, const weft_rad_record *own, weft_rad_record *out,
                    weft_arena *arena, weft_diagnostics *diagnostics);

#endif
