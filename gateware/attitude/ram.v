// Block RAM of the soft core: two read ports, one of which writes bytes. The image is read from a
// file of 32-bit words in hexadecimal when simulation or synthesis begins.
module boresight_ram #(
    parameter WORDS = 6144,
    parameter WIDTH = 13,
    parameter IMAGE = "firmware.hex"
) (
    input clk,
    input [WIDTH-1:0] a_addr,
    output reg [31:0] a_data,
    input [WIDTH-1:0] b_addr,
    input [3:0] b_we,
    input [31:0] b_w_data,
    output reg [31:0] b_data
);
    (* ram_style = "block" *)
    reg [31:0] words [0:WORDS-1];

    initial $readmemh(IMAGE, words);

    always @(posedge clk)
        a_data <= words[a_addr];

    always @(posedge clk) begin
        if (b_we[0]) words[b_addr][7:0] <= b_w_data[7:0];
        if (b_we[1]) words[b_addr][15:8] <= b_w_data[15:8];
        if (b_we[2]) words[b_addr][23:16] <= b_w_data[23:16];
        if (b_we[3]) words[b_addr][31:24] <= b_w_data[31:24];
        b_data <= words[b_addr];
    end
endmodule
