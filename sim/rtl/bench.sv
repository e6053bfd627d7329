// Runs records through a core, in Verilator and in Icarus. Batches come as numbers on standard input,
// results go to standard output; between batches the core stands still, so a closed loop is a batch
// of one record at a time.
//
// Batch: records, bus writes, stall, limit (`Batch`); the number of words of each record; all
// words; for each bus write its record, address and word; for a reset its record, -1 and the cycles
// from the first word taken to it; for a restart -2 in place of -1. If the update is complete before,
// they come then.
// Results, a line each: "0 flags interval" for a record (flags 1: saturated, 2: input beyond its
// range; interval: cycles until the next record could begin, -2: a reset came before, -1: not
// complete after `limit` cycles, or an unknown value); "1 word cycle" before it for each output
// word. Then "end", behind it an unknown value (Icarus).

module bench #(
    parameter WORD = 32
)
`ifdef __ICARUS__
;
    reg clk = 0, rst = 1;
    always #5 clk = !clk;
    initial repeat (4) @(posedge clk) rst <= 0;
`else
(input wire clk, input wire rst);
`endif
    reg [WORD:0] in_payload = 0;
    reg [9:0] bus_addr = 0;
    reg [WORD-1:0] bus_data = 0;
    reg in_valid = 0, out_ready = 0, bus_stb = 0, restart = 0, pulse = 0;
    wire in_ready, out_valid, bus_ack;
    wire [WORD:0] out_payload;
    wire [1:0] flags;
    core dut (
        .clk(clk), .rst(rst | pulse),
        .i__payload(in_payload), .i__valid(in_valid), .i__ready(in_ready),
        .o__payload(out_payload), .o__valid(out_valid), .o__ready(out_ready),
        .bus__addr(bus_addr), .bus__w_data(bus_data), .bus__w_stb(bus_stb),
        .bus__w_ack(bus_ack), .bus__r_data(), .restart(restart),
        .saturated_update(flags[0]), .beyond_update(flags[1])
    );

    longint left = 0;
    int records = 0, orders = 0, stall = 0;
    int counts[], words[], order[];  // of each record, of all records, of the bus
    int update = 0, record = 0, index = 0, at = 0, next = 0, cycle = 0;
    bit running = 0, offer = 0, counting = 0, complete = 0, unknown = 0;
    bit asks, resets, now, waits;
    reg [31:0] lfsr, word;

    function automatic longint number();
        longint value;
        if ($fscanf(32'h8000_0000, "%d", value) != 1) begin
            $finish;
            return 0;
        end
        return value;
    endfunction

    task read_batch;
        int total;
        records = int'(number());
        orders = int'(number());
        stall = int'(number());
        left = number();
        counts = new[records];
        total = 0;
        for (int k = 0; k < records; k++) begin
            counts[k] = int'(number());
            total += counts[k];
        end
        words = new[total];
        for (int k = 0; k < total; k++) words[k] = int'(number());
        order = new[3 * orders + 3];
        for (int k = 0; k < 3 * orders; k++) order[k] = int'(number());
        {update, record, index, at, next, cycle} = 0;
        {counting, complete, unknown} = 0;
        offer = 1;
        lfsr = 32'h2f6e2b1 + stall;
    endtask

    task finish(input int interval);
        $display("0 %0d %0d", flags, interval);
        complete = 0;
        update++;
    endtask

    task give;
        word = out_payload[WORD-1:0];
        $display("1 %0d %0d", word, cycle);
        complete = out_payload[WORD];
    endtask

    // What came of the cycle that ends with this edge.
    task ended;
        asks = in_ready && index == 0 && counting && complete && record == update + 1;
        if (pulse) begin
            if (out_valid) give;
            if (update == order[next]) begin
                if (record == update) at += counts[record] - index;
                finish(-2);
                record = update;
            end
            {index, counting} = 0;
            offer = 1;
            next += 3;
        end else begin
            // The core asks for the first word of the next record: the last update is complete.
            if (asks) finish(cycle);
            if (update < records) begin
                if (out_valid && out_ready) give;
                if (restart || (bus_stb && bus_ack)) next += 3;
                cycle++;
                if (asks) counting = 0;
                if (in_valid && in_ready) begin
                    if (index == 0) begin
                        cycle = 1;
                        counting = 1;
                    end
                    at++;
                    index++;
                    if (index == counts[record]) begin
                        index = 0;
                        record++;
                    end
                    offer = stall == 0 || lfsr[5];
                end else if (!offer) offer = lfsr[9];
                lfsr = {lfsr[30:0], lfsr[31] ^ lfsr[21] ^ lfsr[1] ^ lfsr[0]};
            end
        end
        left--;
    endtask

    // An unknown value that counts is told, and ends the batch.
    task known;
        unknown = 1;
        if (^in_ready === 1'bx) $display("end in_ready = %b, record %0d, cycle %0d", in_ready, update, cycle);
        else if (^out_valid === 1'bx)
            $display("end out_valid = %b, record %0d, cycle %0d", out_valid, update, cycle);
        else if (out_valid && out_ready && ^out_payload === 1'bx)
            $display("end out_payload = %b, record %0d, cycle %0d", out_payload, update, cycle);
        else if (^{bus_stb & bus_ack, flags} === 1'bx)
            $display("end flags = %b, record %0d, cycle %0d", flags, update, cycle);
        else unknown = 0;
    endtask

    always @(posedge clk) if (!rst) begin
        if (running) begin
            known;
            if (unknown) update = records;
            else begin
                ended;
                if (update < records && left < 0) begin
                    finish(-1);
                    update = records;
                end
                if (update == records) $display("end");
            end
            $fflush;
        end
        if (update == records) read_batch;
        running = 1;
        resets = next < 3 * orders && order[next+1] < 0;
        now = resets && (update > order[next]
                         || (counting && update == order[next] && cycle >= order[next+2]));
        pulse <= now && order[next+1] == -1;
        restart <= now && order[next+1] == -2;
        waits = index == 0 && next < 3 * orders
            && (resets ? order[next] < record : order[next] == record);
        in_valid <= offer && record < records && !waits && !(now && order[next+1] == -1);
        if (record < records) begin
            word = words[at];
            in_payload <= {index == counts[record] - 1, word[WORD-1:0]};
        end
        out_ready <= stall == 0 || (lfsr[3] ^ lfsr[17]) || (now && order[next+1] == -1);
        // An idle bus carries anything.
        bus_stb <= waits && !counting && !resets;
        bus_addr <= waits && !resets ? order[next+1] : lfsr[9:0];
        bus_data <= waits && !resets ? order[next+2] : lfsr;
    end
endmodule
