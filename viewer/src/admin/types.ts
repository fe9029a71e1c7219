/** Responses of the organizers' API; the schemas are in docs/schema/openapi.json. Times in ms since 1970 UTC, durations in s. */
import type { Figure } from '../hands/figure_table';
import type { HandDescription } from '../model/hand';

export interface Session {
  session_id: string; team: string; mode: string; status: 'open' | 'ended' | 'voided' | string; client_version: string | null;
  limit_s: number | null; clock_wall_s: number; clock_simulated_s: number; refunded_s: number; paused_unix_ms: number | null;
  pauses: number; created_unix_ms: number; ended_unix_ms: number | null; runs: number; elapsed_s: number; left_s: number | null;
}
export interface Team { team: string; created_unix_ms: number; live_tokens: number; sessions: number }
export interface Token { token_id: string; role: string; team: string | null; label: string; created_unix_ms: number; revoked_unix_ms: number | null }
export interface Issued { team?: string; role?: string; token_id: string; token: string }
export interface Hand {
  hand_id: string; team: string; name: string; sha256: string; bytes: number; status: 'pending' | 'approved' | 'rejected' | string;
  note: string | null; warnings: string[]; created_unix_ms: number; decided_unix_ms: number | null;
}
export interface ShownHand { hand: Hand; figures: Figure[]; in_the_way: string[]; description?: HandDescription }
export interface Similar { run_id: string; team?: string; [more: string]: unknown }
export interface Run {
  run_id: string; team: string; task: string; hand: string; k: number | null; mode: string; sensing: string; status: string;
  reason: string | null; note: string | null; score: number | null; sim_time_s: number | null; started_unix_ms: number;
  ended_unix_ms: number | null; verify_note?: string | null; similar?: Similar[] | null; session_id?: string | null;
}
export interface AuditEntry { seq: number; unix_ms: number; actor: string; action: string; subject: string; reason: string | null }
