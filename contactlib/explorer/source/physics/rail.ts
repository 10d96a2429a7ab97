/** The rail: dry, but for at most one wet patch. */
import type { Profile } from "../kernel/kernel";

/** Places on the rail [m] and the factor on its friction between them [1]. */
export interface Patch {
  begins: number;
  ends: number;
  friction: number;
}

export class Rail {
  patch: Patch | null = null;

  /** The track as the kernel takes it; null if all of it is dry. */
  get track(): Profile | null {
    if (this.patch === null) return null;
    const { begins, ends, friction } = this.patch;
    return { at: [begins, begins, ends, ends], value: [1, friction, friction, 1] };
  }

  /** Whether a place [m] is on the patch. */
  isWet(distance: number): boolean {
    return this.patch !== null && distance >= this.patch.begins && distance < this.patch.ends;
  }

  /** Factor on friction at a place. */
  friction(distance: number): number {
    return this.isWet(distance) ? this.patch!.friction : 1;
  }

  /** Ends of the patch on the way from one place to another. */
  passed(from: number, to: number): ("patch_begins" | "patch_ends")[] {
    const found: ("patch_begins" | "patch_ends")[] = [];
    if (this.patch === null) return found;
    const { begins, ends } = this.patch;
    if (from < begins && to >= begins) found.push("patch_begins");
    if (from < ends && to >= ends) found.push("patch_ends");
    return found;
  }
}
