// A block RAM whose words are bytes of nine bits, as Lattice and Gowin have them: block_ram.v, where
// the ninth bits are parity.

module nine_bit_ram #(
    parameter ROW = 20, UPPER = 9,  // bits from one row to the next, and to its upper byte
    parameter [1024*ROW-1:0] CONTENTS = 0,  // rows of two bytes
    parameter WIDTH_A = 0, WIDTH_B = 0, MODE_A = "NO_CHANGE", MODE_B = "NO_CHANGE", SHARED = 0
) (
    input clk_a, clk_b, en_a, en_b, rst_a, rst_b, writes_a, writes_b,
    input [13:0] addr_a, addr_b,
    input [3:0] we_a, we_b,
    input [35:0] di_a, di_b,
    output [35:0] do_a, do_b
);
    // Bit 8 of each nine is block_ram's parity.
    function [35:0] apart(input [35:0] word);
        apart = {word[35], word[26], word[17], word[8],
                 word[34:27], word[25:18], word[16:9], word[7:0]};
    endfunction
    function [35:0] together(input [35:0] word);
        together = {word[35], word[31:24], word[34], word[23:16],
                    word[33], word[15:8], word[32], word[7:0]};
    endfunction
    function [512*32-1:0] data(input integer unused);
        integer row;
        for (row = 0; row < 1024; row = row + 1) begin
            data[16*row +: 8] = CONTENTS[ROW*row +: 8];
            data[16*row+8 +: 8] = CONTENTS[ROW*row+UPPER +: 8];
        end
    endfunction
    function [512*4-1:0] parity(input integer unused);
        integer row;
        for (row = 0; row < 1024; row = row + 1) begin
            parity[2*row] = CONTENTS[ROW*row+8];
            parity[2*row+1] = CONTENTS[ROW*row+UPPER+8];
        end
    endfunction

    wire [35:0] read_a, read_b;
    block_ram #(
        .WORDS(512), .DATA(data(0)), .PARITY(parity(0)), .WIDTH_A(WIDTH_A), .WIDTH_B(WIDTH_B),
        .MODE_A(MODE_A), .MODE_B(MODE_B), .SHARED(SHARED)
    ) ram (
        .clk_a(clk_a), .clk_b(clk_b), .en_a(en_a), .en_b(en_b), .rst_a(rst_a), .rst_b(rst_b),
        .writes_a(writes_a), .writes_b(writes_b), .addr_a(addr_a), .addr_b(addr_b),
        .we_a(we_a), .we_b(we_b), .di_a(apart(di_a)), .di_b(apart(di_b)),
        .do_a(read_a), .do_b(read_b)
    );
    assign do_a = together(read_a), do_b = together(read_b);
endmodule
