// Changes of the map, with the token that permits them.
import { keyframeName, type Loop, type LoopStatement, type MapData } from "./format";

export interface Outcome {
  epoch: number;
  outcome: string;
}

/** The token leaves the address bar at once and stays in memory only. */
function tokenOfAddress(): string | null {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token !== null) history.replaceState(null, "", location.pathname + location.search);
  return token;
}

export class Commands {
  token: string | null = tokenOfAddress();

  statement(map: MapData, loop: Loop, statement: LoopStatement): Promise<Outcome> {
    const [query, match] = [loop.query, loop.match].map((end) => keyframeName(map, end));
    return this.post("api/loops/statement", { query, match, statement, epoch: map.epoch });
  }

  undo(epoch: number): Promise<Outcome> {
    return this.post("api/undo", { epoch });
  }

  private async post(url: string, body: unknown): Promise<Outcome> {
    const response = await fetch(url, {
      method: "POST",
      body: JSON.stringify(body),
      headers: { "Content-Type": "application/json", Authorization: `Bearer ${this.token ?? ""}` },
    });
    const answer = (await response.json().catch(() => ({}))) as Partial<Outcome> & {
      error?: string;
    };
    if (response.status === 401) throw new Error("the server does not accept this token");
    if (!response.ok) throw new Error(answer.error ?? `the server answers ${response.status}`);
    return { epoch: Number(answer.epoch ?? 0), outcome: String(answer.outcome ?? "") };
  }
}
