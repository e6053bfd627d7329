// Replays a log through the core and writes down what comes out.
//
// Input file: one word (hex) per line, bit WORD set in the last of a record. Bus writes, if any: lines `record
// address data` (address and data hex), done in order before the first word of that record is
// offered. Output file: lines
//   O record word data cycle     an output word was taken; cycle counts from the record's first input word
//   U record saturated cycles    the record's update is complete; cycles until the next could begin
//   R record lane address data cycle   the lane wrote a register (only for record +trace=K)
// With STALL > 0 the input is withheld and the output refused in a pseudo-random pattern.

`timescale 1ns/1ps

module replay #(
    parameter WORD = 32
) (
    input wire clk /*verilator public_flat_rw*/,
    input wire rst /*verilator public_flat_rw*/,
    output reg done /*verilator public_flat_rw*/
);
    integer fin, fout, fbus, steps, stall, scanned, trace;
    string in_name, out_name, bus_name;

    reg [31:0] lfsr;
    reg [WORD:0] word, upcoming;
    integer in_record, in_word, out_record, out_word, cycle, update;
    reg counting;
    integer w_record, w_next_record;
    reg [9:0] w_addr, w_next_addr;
    reg [WORD-1:0] w_data, w_next_data;
    wire w_ack;
    reg offer;
    wire take;

    wire i_ready, o_valid;
    wire [WORD:0] o_payload;
    wire saturated;
    wire in_last = word[WORD];
    wire w_waits = in_word == 0 && w_record == in_record;
    wire w_stb = w_waits && !counting && !rst;
    wire i_valid = offer && in_record < steps && !w_waits;
    wire o_ready = take;

    // A stream must keep valid once raised: `offer` only rises between transfers.
    assign take = stall == 0 || lfsr[3] ^ lfsr[17];

    core dut (
        .clk(clk), .rst(rst),
        .i__payload(word), .i__valid(i_valid), .i__ready(i_ready),
        .o__payload(o_payload), .o__valid(o_valid), .o__ready(o_ready),
        .bus__addr(w_addr), .bus__w_data(w_data), .bus__w_stb(w_stb),
        .bus__w_ack(w_ack), .bus__r_data(), .saturated_update(saturated)
    );

    task next_word;
        begin
            scanned = $fscanf(fin, "%h", upcoming);
            word <= upcoming;
        end
    endtask

    task next_write;
        begin
            w_next_record = -1;
            if (fbus != 0) begin
                scanned = $fscanf(fbus, "%d %h %h", w_next_record, w_next_addr, w_next_data);
                if (scanned != 3) w_next_record = -1;
            end
            w_record <= w_next_record;
            w_addr <= w_next_addr;
            w_data <= w_next_data;
        end
    endtask

    initial begin
        done = 0;
        if (!$value$plusargs("input=%s", in_name)) begin $display("no input"); $finish; end
        if (!$value$plusargs("output=%s", out_name)) begin $display("no output"); $finish; end
        if (!$value$plusargs("steps=%d", steps)) steps = 0;
        if (!$value$plusargs("stall=%d", stall)) stall = 0;
        if (!$value$plusargs("trace=%d", trace)) trace = -1;
        fbus = 0;
        if ($value$plusargs("bus=%s", bus_name)) fbus = $fopen(bus_name, "r");
        fin = $fopen(in_name, "r");
        fout = $fopen(out_name, "w");
        in_record = 0; in_word = 0; out_record = 0; out_word = 0; cycle = 0; update = 0;
        counting = 0;
        offer = 1;
        lfsr = 32'h2f6e2b1 + stall;
        w_next_addr = 0; w_next_data = 0;
        next_word;
        next_write;
    end

    // Register writes of one record, from its first word on, to find the first value that differs.
    always @(posedge clk) if (!rst && !done && counting && update == trace) begin
        if (dut.operands.w_en__0 !== 1'b0)
            $fwrite(fout, "R %0d 0 %h %h %0d\n", update, dut.operands.w_addr__0, dut.operands.w_data__0, cycle);
    end
`ifdef TWO_LANES
    always @(posedge clk) if (!rst && !done && counting && update == trace) begin
        if (dut.operands.w_en__1 !== 1'b0)
            $fwrite(fout, "R %0d 1 %h %h %0d\n", update, dut.operands.w_addr__1, dut.operands.w_data__1, cycle);
    end
`endif

    always @(posedge clk) begin
        if (rst) begin
            cycle <= 0;
        end else if (!done) begin
            lfsr <= {lfsr[30:0], lfsr[31] ^ lfsr[21] ^ lfsr[1] ^ lfsr[0]};
            cycle <= cycle + 1;
            if (w_stb && w_ack === 1'b1) next_write;
            if (i_ready === 1'b1 && in_word == 0 && counting && out_word == 0 && out_record == in_record) begin
                // The core asks for the first word of the next record: the last update is complete.
                $fwrite(fout, "U %0d %b %0d\n", update, saturated, cycle);
                update <= update + 1;
                counting <= 0;
                if (out_record == steps) begin
                    $fclose(fout);
                    done <= 1;
                end
            end
            if (i_valid && i_ready === 1'b1) begin
                if (in_word == 0) begin
                    cycle <= 1;
                    counting <= 1;
                end
                in_word <= in_last ? 0 : in_word + 1;
                if (in_last) in_record <= in_record + 1;
                next_word;
                offer <= stall == 0 || lfsr[5];
            end else if (!offer) offer <= lfsr[9];
            if (o_valid === 1'b1 && o_ready) begin
                $fwrite(fout, "O %0d %0d %h %0d\n", out_record, out_word, o_payload[WORD-1:0], cycle);
                out_word <= o_payload[WORD] === 1'b1 ? 0 : out_word + 1;
                if (o_payload[WORD] === 1'b1) out_record <= out_record + 1;
            end else if (o_valid === 1'bx || i_ready === 1'bx) begin
                $fwrite(fout, "X %0d %0d handshake %0d\n", out_record, out_word, cycle);
            end
        end
    end
endmodule
