// A block RAM of two ports, of which the families' cells are made (spartan6_cells.v, nine_bit_ram.v).
//
// A word has 32 bits and 4 parity bits, one to each byte. A port of 36, 18 or 9 bits has 4, 2 or 1
// parity bits; one of 4, 2 or 1 bits has none. Addresses count bits: a port of D data bits leaves
// out the last log2 D. What a port reads that the other one writes at the same edge is random here,
// unless the other one reads first and SHARED says that this defines it. Both ports have one clock.

module block_ram #(
    parameter WORDS = 512,
    parameter [32*WORDS-1:0] DATA = 0,
    parameter [4*WORDS-1:0] PARITY = 0,
    parameter WIDTH_A = 0, WIDTH_B = 0,  // of a port, with parity; 0: not used
    parameter MODE_A = "WRITE_FIRST", MODE_B = "WRITE_FIRST",
    parameter SHARED = 1,
    parameter [35:0] SRVAL_A = 0, SRVAL_B = 0
) (
    input clk_a, clk_b, en_a, en_b, rst_a, rst_b,
    input writes_a, writes_b,  // the port is written, be it no byte
    input [$clog2(WORDS)+4:0] addr_a, addr_b,
    input [3:0] we_a, we_b,
    input [35:0] di_a, di_b,  // parity above data
    output reg [35:0] do_a, do_b
);
    reg [31:0] data [0:WORDS-1];
    reg [3:0] parity [0:WORDS-1];

    function [31:0] bits(input integer width);  // data bits of a port
        bits = width < 8 ? width : width - width / 9;
    endfunction

    // The bits of a word that a port has, at bit 0.
    function [31:0] mask(input integer width);
        mask = 32'hffffffff >> (32 - bits(width));
    endfunction
    function [4:0] at(input [4:0] low, input integer width);
        at = low & ~(bits(width) - 1);
    endfunction

    // What a port writes: the bits of the word that change, data and parity.
    function [35:0] written(input [3:0] we, input [4:0] low, input integer width);
        reg [31:0] lanes;
        begin
            lanes = width < 8 ? {32{we[0]}} : {{8{we[3]}}, {8{we[2]}}, {8{we[1]}}, {8{we[0]}}};
            written[31:0] = (lanes & mask(width)) << at(low, width);
            written[35:32] = width < 9 ? 4'd0 : (we & mask(width / 9)) << (at(low, width) >> 3);
        end
    endfunction
    function [35:0] placed(input [35:0] word, input [4:0] low, input integer width);
        placed = {word[35:32] << (at(low, width) >> 3), word[31:0] << at(low, width)};
    endfunction
    function [35:0] read(input [35:0] word, input [4:0] low, input integer width);
        read = {width < 9 ? 4'd0 : word[35:32] >> (at(low, width) >> 3) & mask(width / 9),
                word[31:0] >> at(low, width) & mask(width)};
    endfunction

    wire [$clog2(WORDS)-1:0] word_a = addr_a[$clog2(WORDS)+4:5], word_b = addr_b[$clog2(WORDS)+4:5];
    wire [35:0] change_a = en_a && WIDTH_A != 0 ? written(we_a, addr_a[4:0], WIDTH_A) : 36'd0;
    wire [35:0] change_b = en_b && WIDTH_B != 0 ? written(we_b, addr_b[4:0], WIDTH_B) : 36'd0;
    wire [35:0] old_a = {parity[word_a], data[word_a]}, old_b = {parity[word_b], data[word_b]};
    wire [35:0] new_a = old_a & ~change_a | placed(di_a, addr_a[4:0], WIDTH_A) & change_a;
    wire [35:0] new_b = old_b & ~change_b | placed(di_b, addr_b[4:0], WIDTH_B) & change_b;
    // What the other port writes at this edge, to other bits of the word, stays as well.
    wire same = word_a == word_b;
    wire [35:0] next_a = same ? new_a & ~change_b | new_b & change_b : new_a;
    wire [35:0] next_b = same ? new_b & ~change_a | new_a & change_a : new_b;
    wire [35:0] unknown_a = same && !(SHARED && MODE_B == "READ_FIRST") ? change_b : 36'd0;
    wire [35:0] unknown_b = same && !(SHARED && MODE_A == "READ_FIRST") ? change_a : 36'd0;

    integer k;
    initial begin
        for (k = 0; k < WORDS; k = k + 1) begin
            data[k] = DATA[32*k +: 32];
            parity[k] = PARITY[4*k +: 4];
        end
        do_a = 0;
        do_b = 0;
    end
    always @(posedge clk_a) if (en_a && WIDTH_A != 0) begin
        if (|change_a) {parity[word_a], data[word_a]} <= next_a;
        if (rst_a) do_a <= SRVAL_A;
        else if (!writes_a || MODE_A != "NO_CHANGE")
            do_a <= read((MODE_A == "WRITE_FIRST" ? new_a : old_a)
                         ^ unknown_a & {$random, $random}, addr_a[4:0], WIDTH_A);
    end
    always @(posedge clk_b) if (en_b && WIDTH_B != 0) begin
        if (|change_b) {parity[word_b], data[word_b]} <= next_b;
        if (rst_b) do_b <= SRVAL_B;
        else if (!writes_b || MODE_B != "NO_CHANGE")
            do_b <= read((MODE_B == "WRITE_FIRST" ? new_b : old_b)
                         ^ unknown_b & {$random, $random}, addr_b[4:0], WIDTH_B);
    end
endmodule

